"""What is known of landmarks besides their place, the returns predicted from them, and what a cycle teaches of them."""
