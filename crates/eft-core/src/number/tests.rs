//! Lanes are the numbers that they hold, one by one.

use super::*;

#[test]
fn a_lane_that_does_not_exist_is_zero_or_false() {
    assert_eq!((Scalar::lane(7.0, 0), Scalar::lane(7.0, 1)), (7.0, 0.0));
    assert_eq!((Flags::lane(5, 0), Flags::lane(5, 1)), (5, 0));
    assert_eq!((Mask::lane(true, 0), Mask::lane(true, 1), Mask::lane(false, 0)), (true, false, false));
    let (numbers, words, truths) = (Lanes([7.0, 8.0]), LaneFlags([5, 6]), LaneMask([false, true]));
    assert_eq!((numbers.lane(1), numbers.lane(2)), (8.0, 0.0));
    assert_eq!((words.lane(1), words.lane(2)), (6, 0));
    assert_eq!((truths.lane(1), truths.lane(2)), (true, false));
}

#[test]
fn each_lane_is_compared_and_nan_is_neither_less_nor_greater() {
    let (numbers, middle) = ([1.0, 2.0, 3.0, f64::NAN], 2.0);
    let (lanes, bounds) = (Lanes(numbers), Lanes([middle; 4]));
    let single = |compare: fn(f64, f64) -> bool| LaneMask(numbers.map(|number| compare(number, middle)));
    for (found, alone, expected) in [
        (lanes.lt(bounds), single(Scalar::lt), [true, false, false, false]),
        (lanes.le(bounds), single(Scalar::le), [true, true, false, false]),
        (lanes.gt(bounds), single(Scalar::gt), [false, false, true, false]),
        (lanes.ge(bounds), single(Scalar::ge), [false, true, true, false]),
    ] {
        assert_eq!((found.0, alone.0), (expected, expected));
    }
}

#[test]
fn a_word_is_at_least_an_equal_one() {
    let (words, expected) = ([4, 5, 6], [false, true, true]);
    assert_eq!(words.map(|word| f64::at_least(word, 5)), expected);
    assert_eq!(Lanes::<f64, 3>::at_least(LaneFlags(words), LaneFlags([5; 3])).0, expected);
}

#[test]
fn a_number_is_limited_to_both_sides_and_takes_a_sign() {
    let numbers = Lanes([-3.0, -1.0, 2.0, f64::NAN]);
    assert_eq!(numbers.limit(Lanes([-2.0; 4]), Lanes([1.5; 4])), Lanes([-2.0, -1.0, 1.5, -2.0]));
    let directions = Lanes([0.1, -0.1, 0.0, f64::NAN]);
    assert_eq!(Lanes([3.0; 4]).times_sign_of(directions), Lanes([3.0, -3.0, 0.0, 0.0]));
}
