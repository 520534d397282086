"""Effects that a model may lack, one a file; :func:`validation.effect.catalogue` finds them."""
