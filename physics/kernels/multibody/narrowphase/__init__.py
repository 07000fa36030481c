"""Narrow phase: contact points of every pair of shapes."""
