"""The event-driven simulator: motion between events, detection, contacts, the event loop."""
