"""The doors: words of a person enter, answers leave. Nothing inside the house imports them."""
