"""What a fit may claim: verdict, uncertainty, detectability, residual."""
