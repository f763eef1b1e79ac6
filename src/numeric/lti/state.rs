//! State space of a transfer function, and its transition matrices.

use nalgebra::{DMatrix, DVector};

use super::polynomial::mean_size_of_roots;
use super::transfer::{ModelError, TransferFunction};

/// x' = A·x + B·u, y = C·x + D·u: the controllable form in units of the mean magnitude of the
/// poles, so that its matrices are of order one.
#[derive(Debug, Clone)]
pub struct StateSpace {
    /// A \[1/s\].
    pub a: DMatrix<f64>,
    /// B \[1/s\].
    pub b: DVector<f64>,
    /// C, as a column.
    pub c: DVector<f64>,
    /// D.
    pub d: f64,
}

/// Transition over a time h: x(h) = Φ·x(0) + constant·u(0) + slope·u'(0) with a linear input.
#[derive(Debug, Clone)]
pub struct Advance {
    /// Φ.
    pub state: DMatrix<f64>,
    /// Effect of a constant unit input.
    pub constant: DVector<f64>,
    /// Effect of an input that grows by one per second.
    pub slope: DVector<f64>,
}

impl StateSpace {
    /// The state space of a transfer function without its dead time.
    pub fn of(tf: &TransferFunction) -> Self {
        let order = tf.order();
        let (num, den) = (tf.num(), tf.den());
        let size = mean_size_of_roots(den);
        let lead = den[0];
        let missing = den.len() - num.len();
        let padded = |i: usize| i.checked_sub(missing).map_or(0.0, |i| num[i]) / lead;
        let d = padded(0);
        let (mut a, mut b) = (DMatrix::zeros(order, order), DVector::zeros(order));
        let mut c = DVector::zeros(order);
        let mut unit = 1.0;
        for i in 0..order {
            unit *= size;
            let pole = den[i + 1] / lead;
            a[(0, i)] = -pole / unit * size;
            c[i] = (padded(i + 1) - d * pole) / unit;
            if i > 0 {
                a[(i, i - 1)] = size;
            }
        }
        if order > 0 {
            b[0] = size;
        }
        Self { a, b, c, d }
    }

    /// Exact, by one matrix exponential of the states with the input and its slope appended
    /// (Van Loan 1978).
    pub fn advance(&self, h: f64) -> Advance {
        let n = self.b.len();
        let mut joined = DMatrix::zeros(n + 2, n + 2);
        joined.view_mut((0, 0), (n, n)).copy_from(&(&self.a * h));
        joined.view_mut((0, n), (n, 1)).copy_from(&(&self.b * h));
        joined[(n, n + 1)] = h;
        let joined = joined.exp();
        Advance {
            state: joined.view((0, 0), (n, n)).into_owned(),
            constant: joined.view((0, n), (n, 1)).column(0).into_owned(),
            slope: joined.view((0, n + 1), (n, 1)).column(0).into_owned(),
        }
    }

    /// The steady state for a unit input. Fails for an integrator.
    pub fn steady(&self) -> Result<DVector<f64>, ModelError> {
        if self.b.is_empty() {
            return Ok(self.b.clone());
        }
        let steady = self.a.clone().lu().solve(&(-&self.b));
        steady.filter(|x| x.iter().all(|v| v.is_finite())).ok_or(ModelError::NoSteadyState)
    }
}
