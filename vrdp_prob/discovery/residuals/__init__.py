"""What a joint fit leaves, beside the motion that it believes in and what noise alone would leave."""
