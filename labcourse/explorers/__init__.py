"""The lessons' explorers: sliders, buttons and a picture that follows them; one module a topic, `explorer` for all."""
