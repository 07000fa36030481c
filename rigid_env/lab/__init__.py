"""Instruments that users run: speed, accuracy, hard cases, measured tosses, demonstrations, replays."""
