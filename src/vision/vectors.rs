//! Loops compiled for each vector width of the processor, of which the widest runs.

use pulp::{Arch, Simd, WithSimd};

/// Runs a closure whose body is inlined: mark it, and what it calls, `#[inline(always)]`.
pub fn widest<R>(run: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(Run(run))
}

struct Run<F>(F);

impl<R, F: FnOnce() -> R> WithSimd for Run<F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> R {
        (self.0)()
    }
}
