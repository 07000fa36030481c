"""Rates of success that the controllers written by hand reach at least, and random actions at most, of 100 episodes."""

RATES = {
    "BlockCurl": (1.0, 0.1),
    "BlockStack": (1.0, 0.0),
    "BlockBalance": (0.98, 0.0),
}
