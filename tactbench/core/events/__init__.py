"""Events in time: raise a detector's alarms by a policy, match them with true events, and score every threshold."""
