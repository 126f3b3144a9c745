//! The operations that the kernel needs of a processor's vectors, and arrays for processors without an implementation of their own.

use crate::simd::MAX_LANES;
use crate::simd::float::Float;

/// The vectors of an instruction set.
pub(crate) trait Registers {
    type Double: Vector<f64>;
    type Single: Vector<f32>;
}

/// Numbers that go through one instruction together.
pub(crate) trait Vector<T: Float>: Copy {
    /// How many numbers there are.
    const LANES: usize;
    /// Whether there are 32 registers rather than 16.
    const MANY_REGISTERS: bool = false;
    /// Whether a root takes the processor so long that other work should go on meanwhile. This needs registers for both.
    const SLOW_ROOTS: bool = true;

    fn splat(value: T) -> Self;
    /// The first numbers of a slice that holds enough.
    fn load(from: &[T]) -> Self;
    /// Writes the numbers to the start of a slice that has room for them.
    fn store(self, to: &mut [T]);

    /// Writes the numbers in double precision to the start of a slice that has room for them.
    #[inline(always)]
    fn store_doubles(self, to: &mut [f64]) {
        let mut numbers = [T::ZERO; MAX_LANES];
        self.store(&mut numbers);
        // As many as the compiler knows: they go from a register to their place.
        for (to, number) in to[..Self::LANES].iter_mut().zip(&numbers[..Self::LANES]) {
            *to = number.to_f64();
        }
    }

    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `self * factor + addend`.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// `from - self * factor`.
    fn mul_sub_from(self, factor: Self, from: Self) -> Self;
    /// The square root.
    fn root(self) -> Self;
    /// The lesser of two numbers; the other's if one is NaN.
    fn lesser(self, other: Self) -> Self;
    /// The greater of two numbers; the other's if one is NaN.
    fn greater(self, other: Self) -> Self;
    /// `self` where the other is above a limit, zero elsewhere.
    fn only_where_above(self, other: Self, limit: Self) -> Self;
    /// `-self` where the whole number that was added to [`Float::ROUNDER`] is odd.
    fn negated_if_odd(self, rounded: Self) -> Self;
    /// Two to the power of a whole number.
    fn two_to(self) -> Self;
    /// The whole e for which `self / 2^e` lies within a factor √2 of 1.
    fn exponent(self) -> Self;

    /// The square root, its reciprocal, and the reciprocal of the number itself; for numbers above zero.
    ///
    /// Root and division are slow. The division by the number itself does not wait for the root.
    #[inline(always)]
    fn root_and_reciprocals(self) -> [Self; 3] {
        let (root, reciprocal) = (self.root(), Self::splat(T::ONE).div(self));
        [root, root.mul(reciprocal), reciprocal]
    }
}

/// Arrays of `DOUBLES` or `SINGLES` numbers, which the compiler turns into the vectors of any processor.
///
/// `FUSED` says whether the processor multiplies and adds in one instruction. Otherwise `f64::mul_add` would be a library call, many
/// times slower than the two operations.
pub(crate) struct Plain<const DOUBLES: usize, const SINGLES: usize, const FUSED: bool>;

impl<const DOUBLES: usize, const SINGLES: usize, const FUSED: bool> Registers
    for Plain<DOUBLES, SINGLES, FUSED>
{
    type Double = Array<f64, DOUBLES, FUSED>;
    type Single = Array<f32, SINGLES, FUSED>;
}

/// A vector as an array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Array<T, const W: usize, const FUSED: bool>([T; W]);

/// Methods that apply the same operation to each number.
macro_rules! lane_by_lane {
    ($($name:ident($a:ident $(, $more:ident)*) = $value:expr;)*) => {$(
        #[inline(always)]
        fn $name(mut self $(, $more: Self)*) -> Self {
            for lane in 0..W {
                let $a = self.0[lane];
                $(let $more = $more.0[lane];)*
                self.0[lane] = $value;
            }
            self
        }
    )*};
}

impl<T: Float, const W: usize, const FUSED: bool> Vector<T> for Array<T, W, FUSED> {
    const LANES: usize = W;

    #[inline(always)]
    fn splat(value: T) -> Self {
        Self([value; W])
    }

    #[inline(always)]
    fn load(from: &[T]) -> Self {
        Self(*from.first_chunk().expect("enough numbers"))
    }

    #[inline(always)]
    fn store(self, to: &mut [T]) {
        *to.first_chunk_mut().expect("room enough") = self.0;
    }

    #[inline(always)]
    fn store_doubles(self, to: &mut [f64]) {
        // If the compiler saw that two singles fill a vector when they are stored, it would sum them two by two, at half the speed.
        for (to, number) in to[..W].iter_mut().zip(std::hint::black_box(self.0)) {
            *to = number.to_f64();
        }
    }

    lane_by_lane! {
        add(a, b) = a + b;
        sub(a, b) = a - b;
        mul(a, b) = a * b;
        div(a, b) = a / b;
        mul_add(a, b, c) = if FUSED { a.fused(b, c) } else { a * b + c };
        mul_sub_from(a, b, c) = if FUSED { (-a).fused(b, c) } else { c - a * b };
        root(a) = a.root();
        lesser(a, b) = if a < b { a } else { b };
        greater(a, b) = if a > b { a } else { b };
        only_where_above(a, b, limit) = if b > limit { a } else { T::ZERO };
        negated_if_odd(a, rounded) = a.negated_if_odd(rounded);
        two_to(a) = a.two_to();
        exponent(a) = a.exponent();
    }
}
