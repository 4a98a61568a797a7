//! The bad inputs: what is refused, by which error, and what is legal but poor.

mod domains;
mod operators;
mod runs;
mod sets;
mod world;

use crate::case::Duty::{self, Adapt, Prevent, Report};
use crate::case::{Entry, Scene};

const fn entry(number: u32, title: &'static str, duties: &'static [Duty], scene: Scene) -> Entry {
    Entry { number, title, duties, not_offered: None, scene }
}

const fn refusal(number: u32, title: &'static str, scene: Scene) -> Entry {
    entry(number, title, &[Report], scene)
}

pub const ENTRIES: [Entry; 66] = [
    refusal(1, "empty set", sets::empty),
    refusal(2, "one particle", sets::one),
    refusal(3, "two coincident", sets::two),
    refusal(4, "all coincident", sets::coincident),
    refusal(5, "one pair at 1e-300", sets::close_pair),
    refusal(6, "NaN coordinate", sets::nan_coordinate),
    refusal(7, "infinite coordinate", sets::infinite_coordinate),
    refusal(8, "coordinate at minus infinity", sets::negative_infinity),
    refusal(9, "NaN strength", sets::nan_strength),
    refusal(10, "infinite strength", sets::infinite_strength),
    refusal(11, "zero volume", sets::zero_volume),
    refusal(12, "negative volume", sets::negative_volume),
    refusal(13, "NaN volume", sets::nan_volume),
    refusal(14, "unequal lengths", sets::unequal),
    entry(15, "more particles than the index holds", &[Report, Prevent], sets::too_many),
    refusal(16, "coordinates of 1e200", sets::far),
    refusal(17, "subnormal spacing", sets::subnormal),
    refusal(18, "collinear in the plane", sets::collinear),
    refusal(19, "coplanar in space", sets::coplanar),
    refusal(20, "4096 sharing one coordinate", sets::shared_coordinate),
    entry(21, "a million duplicates", &[Report, Prevent], sets::many_coincident),
    refusal(22, "one outlier", sets::outlier),
    refusal(23, "volumes unlike the box", sets::volume_defect),
    refusal(24, "lower face not below the upper", domains::reversed),
    refusal(25, "NaN face", domains::nan_face),
    refusal(26, "width below two cutoffs", domains::narrow),
    refusal(27, "particle outside", domains::outside),
    entry(28, "exactly on the upper face", &[Adapt], domains::upper_face),
    entry(29, "one ulp below the lower face", &[Adapt], domains::below_face),
    refusal(30, "width 1e-300", domains::thin_box),
    refusal(31, "width 1e300", domains::wide_box),
    refusal(32, "cutoff 0", domains::zero_cutoff),
    refusal(33, "negative cutoff", domains::negative_cutoff),
    refusal(34, "NaN cutoff", domains::nan_cutoff),
    refusal(35, "infinite cutoff", domains::infinite_cutoff),
    entry(36, "cells beyond 2^31 along an axis", &[Adapt, Report], domains::cells),
    entry(37, "query before build", &[Prevent, Report], domains::unbuilt),
    entry(38, "query after moving beyond the skin", &[Report, Adapt], domains::stale),
    entry(39, "neighbor at exactly the cutoff", &[Prevent], domains::tie),
    refusal(40, "epsilon 0", operators::zero_epsilon),
    refusal(41, "epsilon negative or NaN", operators::bad_epsilon),
    refusal(42, "degree whose factorial overflows", operators::high_degree),
    refusal(43, "order 0", operators::zero_order),
    refusal(44, "fewer neighbors than conditions", operators::too_few),
    refusal(45, "as many neighbors as conditions on a lattice", operators::lattice),
    refusal(46, "rank deficient by geometry", operators::on_a_circle),
    refusal(47, "condition above the limit", operators::ill_conditioned),
    refusal(48, "window underflow", operators::narrow_window),
    refusal(49, "flat window", operators::flat_window),
    refusal(50, "center inside its own stencil", operators::own_center),
    refusal(51, "repeated neighbor", operators::repeated),
    refusal(52, "NaN offset", operators::nan_offset),
    entry(53, "upwind, zero velocity", &[Prevent], operators::still_flow),
    refusal(54, "upwind, empty half-space", operators::empty_side),
    entry(55, "symmetric operator on unequal volumes", &[Prevent, Report], operators::unequal_volumes),
    refusal(56, "wrong output length", runs::output_length),
    refusal(57, "rows of another generation", runs::stale_rows),
    refusal(58, "NaN field at one particle", runs::nan_field),
    refusal(59, "step zero, negative or NaN", runs::bad_step),
    refusal(60, "t + dt = t", runs::no_progress),
    entry(61, "CFL, LCFL or diffusion limit exceeded", &[Report, Prevent], runs::above_limits),
    entry(62, "source returns NaN", &[Report, Prevent], runs::nan_source),
    entry(63, "function panics", &[Prevent], runs::panicking),
    refusal(64, "remeshing grid does not cover", runs::uncovered),
    refusal(65, "kernel support crosses a wall", runs::across_a_wall),
    entry(66, "writer fails at byte k", &[Report, Prevent], runs::failing_writer),
];
