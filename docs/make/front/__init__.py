"""The pictures of the README and of the start page, made by the package itself."""
