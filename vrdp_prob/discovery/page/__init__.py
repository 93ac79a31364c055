"""A finding as documents: figures, sentences, finding.html, finding.json and model.toml."""
