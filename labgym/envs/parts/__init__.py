"""Parts of an environment: sensors, noise, rewards, endings, measures, actions and robots."""
