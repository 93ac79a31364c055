"""Files that hold scenes and questions."""
