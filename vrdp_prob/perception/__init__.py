"""Video to tracks."""
