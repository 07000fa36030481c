"""Instruments for users: measure speed and accuracy, run hard cases, replay measured tosses, draw demonstrations."""
