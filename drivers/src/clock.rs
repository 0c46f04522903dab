//! Hardware and software stamps mapped to one monotonic time.
