"""Whether anything that a fit leaves is more than noise, by what it may depend on."""
