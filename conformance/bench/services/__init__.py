"""The node's services as checks look at them."""
