"""From results to what people and programs read: results.json, JUnit, the terminal."""
