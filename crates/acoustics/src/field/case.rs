//! The cases that the sum over a tile is compiled for.

/// What is summed, and what may be taken for granted about the kernel. The code for a case has no branches that the case does not
/// need, which leaves it more registers.
pub(super) trait Case {
    /// The air is still, uniform and clear, and the receiver is equally sensitive in all directions.
    const PLAIN_AIR: bool = true;
    /// All sources face along z.
    const UPRIGHT: bool = false;
    /// Sources have a near field.
    const NEAR_FIELD: bool = false;
    /// The squares of the sources' contributions are summed too.
    const SQUARES: bool = false;
    /// Derivatives are summed too.
    const DERIVATIVES: bool = false;
    /// The kernel has the usual properties (`FieldKernel::is_usual`), and derivatives are by the usual parameters.
    const USUAL: bool = false;
    /// The kernel has the properties of the thesis's transducer (`FieldKernel::is_thesis`), and derivatives are by the usual parameters.
    const THESIS: bool = false;
}

/// The field of sources that face along z, in plain air.
pub(super) struct PlainField;

impl Case for PlainField {
    const UPRIGHT: bool = true;
}

/// The field of a kernel with the usual properties.
pub(super) struct UsualField;

impl Case for UsualField {
    const UPRIGHT: bool = true;
    const USUAL: bool = true;
}

/// The same with near fields.
pub(super) struct PlainNearField;

impl Case for PlainNearField {
    const UPRIGHT: bool = true;
    const NEAR_FIELD: bool = true;
}

/// The field of any kernel.
pub(super) struct AnyField;

impl Case for AnyField {
    const PLAIN_AIR: bool = false;
    const NEAR_FIELD: bool = true;
}

/// The field of any kernel and the sums of squares.
pub(super) struct AnyFieldAndSquares;

impl Case for AnyFieldAndSquares {
    const PLAIN_AIR: bool = false;
    const NEAR_FIELD: bool = true;
    const SQUARES: bool = true;
}

/// The field in plain air and its derivatives by any parameters.
pub(super) struct AnyDerivatives;

impl Case for AnyDerivatives {
    const DERIVATIVES: bool = true;
}

/// The field and its derivatives in the usual case.
pub(super) struct UsualDerivatives;

impl Case for UsualDerivatives {
    const UPRIGHT: bool = true;
    const DERIVATIVES: bool = true;
    const USUAL: bool = true;
}

/// The field and its derivatives by the usual parameters for the thesis's transducer.
pub(super) struct ThesisDerivatives;

impl Case for ThesisDerivatives {
    const UPRIGHT: bool = true;
    const DERIVATIVES: bool = true;
    const THESIS: bool = true;
}
