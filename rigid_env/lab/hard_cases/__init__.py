"""Command `rigid-env hard-cases`: runs `rigid_env.hard_cases` in our engine and in others, and shows the outcomes."""
