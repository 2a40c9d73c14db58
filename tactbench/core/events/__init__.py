"""Events in time: alarms of a detector under a stated policy, matched with true events, scored at every threshold."""
