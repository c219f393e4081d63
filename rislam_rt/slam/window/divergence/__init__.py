"""Lost or not, and what becomes of the belief then."""
