//! Drive units to SI.
