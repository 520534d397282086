"""A benchmark that others can take: blind cases, a sealed file of answers, and the score of anyone's answers."""
