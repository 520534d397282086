"""The paper's loop widths read twice, as full and as half widths: which rigs meet its statements under each reading."""
