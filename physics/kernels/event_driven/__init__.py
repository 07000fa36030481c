"""Event-driven scheme: smooth motion to rounding between events, at which contacts begin, end, stick, slip, collide."""
