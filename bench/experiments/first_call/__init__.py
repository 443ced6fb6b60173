"""What the first call of each public function costs: compiled then, or read from disk."""
