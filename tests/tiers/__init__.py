"""Two tiers of tests, and two ways to run a test: `docs/testing.md`."""
