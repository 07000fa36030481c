"""The command `rigid-env hard-cases`: run `rigid_env.hard_cases` in our engine and in others, and show the outcomes."""
