"""One table of wrong inputs: every one is an error that names the field, the value and the allowed ones."""
