"""Traffic feeds: one module a format, all behind ``protocol.Feed``."""
