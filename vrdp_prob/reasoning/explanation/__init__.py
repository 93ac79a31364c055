"""Why an answer is uncertain: what it hangs on, where the doubt comes from, what would settle it."""
