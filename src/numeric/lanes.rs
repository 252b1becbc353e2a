//! Plain loops over many values, compiled for every processor and again for those with wider vectors.
//!
//! rustc neither contracts nor reorders floating-point operations, so all versions have the same bits
//! (contract 4). A loop over arrays of a constant length, without calls and without an early end, becomes
//! vector instructions.

/// Values that a kernel's loop works on together: several vectors of any processor, and little enough stack.
pub const BLOCK: usize = 64;

/// 1.5 · 2⁵². Added to a number of magnitude up to 2⁵⁰, it leaves no bit for a fraction: the addition rounds
/// half to even, and the sum's low bits are the whole number. `round_ties_even` would be a call on processors
/// before SSE 4.1.
pub(crate) const WHOLE: f64 = 6_755_399_441_055_744.0;

/// Whether the processor has the parts of AVX-512 that `wide!` compiles for.
#[cfg(target_arch = "x86_64")]
#[inline]
pub(crate) fn has_avx512() -> bool {
    std::arch::is_x86_feature_detected!("avx512f")
        && std::arch::is_x86_feature_detected!("avx512bw")
        && std::arch::is_x86_feature_detected!("avx512dq")
        && std::arch::is_x86_feature_detected!("avx512vl")
}

/// Defines a function three times, for every processor and for those with AVX2 and AVX-512, and calls the one
/// that fits. Only what is inlined into the function is compiled with it: hence `#[inline(always)]` on a
/// kernel's parts.
macro_rules! wide {
    ($(#[$attribute:meta])* $vis:vis fn $name:ident($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$attribute])*
        $vis fn $name($($argument: $type),*) $(-> $result)? {
            #[inline(always)]
            fn plain($($argument: $type),*) $(-> $result)? $body
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                fn avx2($($argument: $type),*) $(-> $result)? {
                    plain($($argument),*)
                }
                #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
                fn avx512($($argument: $type),*) $(-> $result)? {
                    plain($($argument),*)
                }
                if $crate::numeric::lanes::has_avx512() {
                    #[expect(unsafe_code, reason = "the same function, for a processor that was just looked at")]
                    // SAFETY: the processor has what the function is compiled for.
                    return unsafe { avx512($($argument),*) };
                }
                if std::arch::is_x86_feature_detected!("avx2") {
                    #[expect(unsafe_code, reason = "the same function, for a processor that was just looked at")]
                    // SAFETY: the processor has AVX2.
                    return unsafe { avx2($($argument),*) };
                }
            }
            plain($($argument),*)
        }
    };
}
pub(crate) use wide;
