raise RuntimeError("the vendor library is not installed")
