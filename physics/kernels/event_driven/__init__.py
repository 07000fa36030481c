"""The event-driven scheme: smooth motion to rounding, cut where contacts begin, end, stick, slip or collide."""
