"""Where work is done: in this process, in processes of their own, or on a cluster; results do not depend on which."""
