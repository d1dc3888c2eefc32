"""Read a case: inputs by name, unit and bound; contact and direction; an interval of k."""
