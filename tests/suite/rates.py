"""Rates of success that the controllers written by hand reach at least, and random actions at most, of 100 episodes."""

RATES = {
    "BlockCurl": (1.0, 0.1),
    "TwoPushers": (0.9, 0.02),
    "BlockLand": (0.98, 0.3),  # a face in six comes down by chance
    "BlockPose": (0.98, 0.0),
    "BallKick": (0.95, 0.05),
    "BallJuggle": (1.0, 0.0),
    "BlockStack": (1.0, 0.0),
    "BlockPush": (0.92, 0.03),
    "BlockBalance": (0.98, 0.0),
}
