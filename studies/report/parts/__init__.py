"""Parts of the page that are read from one kind of result each: fits, validation, compensation, and what to do."""
