"""Forces, energies, steps and motions of mass-spring systems: cases, laws, models and faults."""
