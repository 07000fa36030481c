"""Types of the public interface, as a user's checker sees them."""
