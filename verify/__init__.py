"""Judge anyone's solver, in any language: doors, protocol, cases, laws, faults and diagnosis."""
