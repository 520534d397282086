"""Effects that a model may lack, one a file; :func:`validation.tracing.effect.catalogue` finds them."""
