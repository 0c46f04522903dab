//! Vector instructions where the processor has them.
//!
//! The released program runs on every x86-64 processor, and finds out at run time what this one can
//! do. Multiplications and additions are never contracted to one, so that every processor computes
//! the same bits.

/// Calls `work` with AVX2 where the processor has it; `work` and all that is inlined into it are
/// compiled for both cases.
///
/// A closure is handed over as `#[inline(always)] || …`: one that is not inlined is compiled for the
/// baseline alone.
#[inline(always)]
#[allow(unsafe_code, reason = "a function with a target feature is called")]
pub(crate) fn vectorised<R>(work: impl FnOnce() -> R) -> R {
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
