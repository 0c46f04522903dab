//! Vector instructions, if the processor has them.
//!
//! The released program runs on every x86-64 processor, and finds out at run time what this one can
//! do (function multiversioning). Results may differ between processors by rounding.

/// Calls `work` with AVX2 if the processor has it. `work` and everything inlined into it are
/// compiled for both cases.
///
/// Pass a closure as `#[inline(always)] || …`: a closure that is not inlined is compiled for the
/// baseline only.
#[inline(always)]
#[allow(unsafe_code, reason = "a function with a target feature is called")]
pub fn with_vector_instructions<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the feature, and the operating system saves its registers,
            // which is part of what is detected.
            return unsafe { with_avx2(work) };
        }
    }
    work()
}

/// Number of lanes of an AVX2 register, the widest that is used. Another width would change the
/// rounding of sums over lanes.
pub const WIDTH: usize = 4;

/// Returns `value` of each lane, in order. Unlike `core::array::from_fn` it is always inlined, and
/// so compiled with the vector instructions of its caller.
#[inline(always)]
pub fn from_lanes<const L: usize>(mut value: impl FnMut(usize) -> f64) -> [f64; L] {
    let mut values = [0.0; L];
    for (l, lane) in values.iter_mut().enumerate() {
        *lane = value(l);
    }
    values
}
