"""What wrong answers show by themselves, without any catalogue of mistakes."""
