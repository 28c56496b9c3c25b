//! Straight lines through logarithms.

use serde::Serialize;

/// A slope with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// Least squares.
    pub slope: f64,
    /// Half the width of the interval; none for two points.
    pub confidence_95: Option<f64>,
    /// Value at 1 that the line goes through.
    pub factor: f64,
}

/// 97.5 % quantiles of Student's distribution for 1 to 10 degrees of freedom.
const STUDENT: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];

/// The quantile, beyond the table by Cornish and Fisher's expansion (Abramowitz and Stegun 26.7.5).
fn student(degrees: usize) -> f64 {
    if let Some(quantile) = STUDENT.get(degrees - 1) {
        return *quantile;
    }
    let (z, n) = (1.959_964_f64, degrees as f64);
    z + (z.powi(3) + z) / (4.0 * n) + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * n * n)
}

/// The slope of log y over log x by least squares; `None` for fewer than two different x, or a value that is not above 0.
pub fn log_log_slope(points: &[(f64, f64)]) -> Option<Slope> {
    if points.len() < 2 || points.iter().any(|(x, y)| *x <= 0.0 || *y <= 0.0 || !x.is_finite() || !y.is_finite()) {
        return None;
    }
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mean_x, mean_y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let square = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum::<f64>();
    if square == 0.0 {
        return None;
    }
    let slope = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum::<f64>() / square;
    let rest = logs.iter().map(|p| (p.1 - mean_y - slope * (p.0 - mean_x)).powi(2)).sum::<f64>();
    let confidence_95 = (logs.len() > 2).then(|| student(logs.len() - 2) * (rest / (n - 2.0) / square).sqrt());
    Some(Slope { slope, confidence_95, factor: (mean_y - slope * mean_x).exp() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_is_a_line() {
        let points: Vec<(f64, f64)> = (1..9).map(|i| (f64::from(i), 3.0 * f64::from(i).powf(-0.75))).collect();
        let slope = log_log_slope(&points).unwrap();
        assert!((slope.slope + 0.75).abs() < 1e-12 && (slope.factor - 3.0).abs() < 1e-12);
        assert!(slope.confidence_95.unwrap() < 1e-9);
        assert!(log_log_slope(&points[..1]).is_none() && log_log_slope(&[(1.0, 1.0), (1.0, 2.0)]).is_none());
        assert_eq!(log_log_slope(&points[..2]).unwrap().confidence_95, None);
    }

    /// By hand: logs 0, 1, 2 and 0, −1, −1 give slope −½, residual sum 1/6, standard error √(1/12), quantile 12.706.
    #[test]
    fn the_interval_is_student_s() {
        let e = std::f64::consts::E;
        let slope = log_log_slope(&[(1.0, 1.0), (e, 1.0 / e), (e * e, 1.0 / e)]).unwrap();
        assert!((slope.slope + 0.5).abs() < 1e-12);
        assert!((slope.confidence_95.unwrap() - 12.706 * (1.0_f64 / 12.0).sqrt()).abs() < 1e-9);
        assert!((student(30) - 2.0423).abs() < 1e-3 && (student(11) - 2.201).abs() < 3e-3);
    }
}
