//! The least value of a function of one positive number, by golden section (J. Kiefer, Proc. AMS 4, 502, 1953).

/// The least value of a function of a positive number and where it stands, over its logarithm, to half a percent.
pub(super) fn least(from: f64, to: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let (mut low, mut high) = (from.ln(), to.ln());
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let at = |low: f64, high: f64, share: f64| low + share * (high - low);
    let (mut x1, mut x2) = (at(low, high, 1.0 - GOLDEN), at(low, high, GOLDEN));
    let (mut f1, mut f2) = (f(x1.exp()), f(x2.exp()));
    while high - low > 5e-3 {
        if f1 < f2 {
            (high, x2, f2) = (x2, x1, f1);
            x1 = at(low, high, 1.0 - GOLDEN);
            f1 = f(x1.exp());
        } else {
            (low, x1, f1) = (x1, x2, f2);
            x2 = at(low, high, GOLDEN);
            f2 = f(x2.exp());
        }
    }
    let x = 0.5 * (low + high);
    (x.exp(), f(x.exp()))
}
