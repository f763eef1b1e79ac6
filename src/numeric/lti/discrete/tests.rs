#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::numeric::lti::{FirstOrder, Simulator, simulate};

struct Plant {
    num: &'static [f64],
    den: &'static [f64],
}

struct Case {
    plant: Plant,
    method: DiscretisationMethod,
    num: &'static [f64],
    den: &'static [f64],
}

const DRIVE: Plant = Plant { num: &[439.0, 35.08], den: &[1.523, 11.44, 1.0] };
const FLOW: Plant = Plant { num: &[9.175, 149.2, 905.3], den: &[1.0, 12.84, 47.52] };
const WHEEL: Plant = Plant { num: &[2.517], den: &[0.0377, 1.0] };
const COMPENSATOR: Plant = Plant { num: &[0.0377, 1.0], den: &[0.02517, 2.517] };
const FIRST_ORDER: Plant = Plant { num: &[1.0], den: &[0.84, 1.0] };

const DT_S: f64 = 0.005;

/// The thesis' models at 200 Hz, by a tool of its own (`SciPy`'s
/// `cont2discrete`).
const CASES: [Case; 20] = [
    Case {
        plant: DRIVE,
        method: DiscretisationMethod::ZeroOrderHold,
        num: &[0.0, 1.414_786_004_555_088_2, -1.414_220_847_539_002_3],
        den: &[1.0, -1.963_122_970_963_488, 0.963_139_081_482_760_6],
    },
    Case {
        plant: DRIVE,
        method: DiscretisationMethod::Bilinear,
        num: &[0.707_472_820_504_558, 0.000_282_610_359_425_228_3, -0.707_190_210_145_131_6],
        den: &[1.0, -1.963_118_864_724_862, 0.963_134_977_060_063_1],
    },
    Case {
        plant: DRIVE,
        method: DiscretisationMethod::FirstOrderHold,
        num: &[0.711_773_868_747_122_6, -0.008_477_219_556_032_09, -0.702_731_492_175_005_1],
        den: &[1.0, -1.963_122_970_963_488, 0.963_139_081_482_760_6],
    },
    Case {
        plant: DRIVE,
        method: DiscretisationMethod::BackwardDifference,
        num: &[1.389_597_683_874_132_2, -1.389_042_699_615_561_4, 0.0],
        den: &[1.0, -1.963_770_981_980_414_3, 0.963_786_802_512_300_6],
    },
    Case {
        plant: FLOW,
        method: DiscretisationMethod::ZeroOrderHold,
        num: &[9.175, -17.611_173_840_309_69, 8.458_092_967_893_725],
        den: &[1.0, -1.936_666_862_840_546_8, 0.937_817_417_289_672_5],
    },
    Case {
        plant: FLOW,
        method: DiscretisationMethod::Bilinear,
        num: &[9.253_860_796_767_135, -17.763_209_065_892_283, 8.531_270_552_897_768],
        den: &[1.0, -1.936_663_899_643_257, 0.937_814_619_763_520_8],
    },
    Case {
        plant: FLOW,
        method: DiscretisationMethod::FirstOrderHold,
        num: &[9.253_746_348_967_516, -17.762_970_092_788_68, 8.531_142_871_405_203],
        den: &[1.0, -1.936_666_862_840_546_8, 0.937_817_417_289_672_5],
    },
    Case {
        plant: FLOW,
        method: DiscretisationMethod::BackwardDifference,
        num: &[9.333_343_814_647_81, -17.923_986_378_671_43, 8.611_885_998_340_506],
        den: &[1.0, -1.937_510_090_220_651_5, 0.938_625_176_930_845_4],
    },
    Case {
        plant: WHEEL,
        method: DiscretisationMethod::ZeroOrderHold,
        num: &[0.0, 0.312_630_071_268_986_45],
        den: &[1.0, -0.875_792_581_935_245_8],
    },
    Case {
        plant: WHEEL,
        method: DiscretisationMethod::Bilinear,
        num: &[0.156_529_850_746_268_68, 0.156_529_850_746_268_68],
        den: &[1.0, -0.875_621_890_547_263_7],
    },
    Case {
        plant: WHEEL,
        method: DiscretisationMethod::FirstOrderHold,
        num: &[0.159_769_262_631_842_2, 0.152_860_808_637_144_24],
        den: &[1.0, -0.875_792_581_935_245_8],
    },
    Case {
        plant: WHEEL,
        method: DiscretisationMethod::BackwardDifference,
        num: &[0.294_730_679_156_908_65, 0.0],
        den: &[1.0, -0.882_903_981_264_637],
    },
    Case {
        plant: COMPENSATOR,
        method: DiscretisationMethod::ZeroOrderHold,
        num: &[1.497_814_858_959_078, -1.341_490_130_994_292_2],
        den: &[1.0, -0.606_530_659_712_633_4],
    },
    Case {
        plant: COMPENSATOR,
        method: DiscretisationMethod::Bilinear,
        num: &[1.277_711_561_382_598_2, -1.118_792_212_951_926_8],
        den: &[1.0, -0.6],
    },
    Case {
        plant: COMPENSATOR,
        method: DiscretisationMethod::FirstOrderHold,
        num: &[1.263_337_364_001_593_5, -1.107_012_636_036_807_3],
        den: &[1.0, -0.606_530_659_712_633_4],
    },
    Case {
        plant: COMPENSATOR,
        method: DiscretisationMethod::BackwardDifference,
        num: &[1.130_976_029_664_945, -0.998_543_239_306_051_9],
        den: &[1.0, -0.666_666_666_666_666_6],
    },
    Case {
        plant: FIRST_ORDER,
        method: DiscretisationMethod::ZeroOrderHold,
        num: &[0.0, 0.005_934_700_630_277_9],
        den: &[1.0, -0.994_065_299_369_722_1],
    },
    Case {
        plant: FIRST_ORDER,
        method: DiscretisationMethod::Bilinear,
        num: &[0.002_967_359_050_445_095_3, 0.002_967_359_050_445_095_3],
        den: &[1.0, -0.994_065_281_899_109_8],
    },
    Case {
        plant: FIRST_ORDER,
        method: DiscretisationMethod::FirstOrderHold,
        num: &[0.002_970_294_113_316_396_3, 0.002_964_406_516_961_504],
        den: &[1.0, -0.994_065_299_369_722_1],
    },
    Case {
        plant: FIRST_ORDER,
        method: DiscretisationMethod::BackwardDifference,
        num: &[0.005_917_159_763_313_64, 0.0],
        den: &[1.0, -0.994_082_840_236_686_4],
    },
];

fn near(found: &[f64], wanted: &[f64]) -> bool {
    let largest = wanted.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
    found.len() == wanted.len()
        && found.iter().zip(wanted).all(|(f, w)| (f - w).abs() <= 1e-9 * largest)
}

#[test]
fn the_models_of_the_thesis_are_those_of_another_tool_to_a_billionth() {
    for Case { plant, method, num, den } in CASES {
        let tf = TransferFunction::new(plant.num, plant.den, 0.0).unwrap();
        let found = tf.discretise(DT_S, method).unwrap();
        assert!(near(&found.num, num), "{method:?} {:?} {num:?}", found.num);
        assert!(near(&found.den, den), "{method:?} {:?} {den:?}", found.den);
    }
}

#[test]
fn matched_poles_and_zeros_stand_at_their_exponentials_and_keep_the_gain() {
    let tf = TransferFunction::new(&[439.0, 35.08], &[1.523, 11.44, 1.0], 0.0).unwrap();
    let found = tf.discretise(DT_S, DiscretisationMethod::MatchedPoleZero).unwrap();
    for pole in tf.poles() {
        assert!(evaluate(&found.den, exp(pole * DT_S)).norm() < 1e-12);
    }
    for zero in tf.zeros() {
        assert!(evaluate(&found.num, exp(zero * DT_S)).norm() < 1e-12);
    }
    let dc_gain = found.num.iter().sum::<f64>() / found.den.iter().sum::<f64>();
    assert!((dc_gain - 35.08).abs() < 1e-6);
    assert_eq!(found.num[0], 0.0, "it answers one step later");
    // A double lag: one zero at -1.
    let lag = TransferFunction::new(&[1.0], &[1.0, 2.0, 1.0], 0.0).unwrap();
    let found = lag.discretise(0.1, DiscretisationMethod::MatchedPoleZero).unwrap();
    assert!((found.num[1] - found.num[2]).abs() < 1e-15 && found.num[0] == 0.0, "{found:?}");
    // An integrator keeps its size and sign where it can be compared.
    let integrator = TransferFunction::new(&[-2.0], &[1.0, 0.0], 0.0).unwrap();
    let found = integrator.discretise(0.1, DiscretisationMethod::MatchedPoleZero).unwrap();
    assert!((found.num[1] + 0.2).abs() < 1e-3, "{found:?}");
}

#[test]
fn a_hold_keeps_a_dead_time_that_ends_within_a_step() {
    let tf = FirstOrder { gain: 1.0, time_constant_s: 0.84, zero_s: 0.0, dead_time_s: 0.417 }
        .transfer()
        .unwrap();
    let found = tf.discretise(0.02, DiscretisationMethod::ZeroOrderHold).unwrap();
    assert_eq!((found.delay, found.num.len()), (20, 3));
    // The modified z-transform of a first-order lag: m = 1 - rest/dt.
    let (whole, part) = (libm::exp(-0.02 / 0.84), libm::exp(-0.003 / 0.84));
    assert!((found.num[1] - (1.0 - part)).abs() < 1e-12);
    assert!((found.num[2] - (part - whole)).abs() < 1e-12);
}

/// The outputs by the difference equation.
fn outputs(model: &DiscreteTransfer, input: &[f64]) -> Vec<f64> {
    let mut output: Vec<f64> = Vec::new();
    for k in 0..input.len() {
        let before = |row: &[f64], i: usize| k.checked_sub(i).map_or(0.0, |at| row[at]);
        let driven = model.num.iter().enumerate();
        let driven: f64 = driven.map(|(i, b)| b * before(input, model.delay + i)).sum();
        let own = model.den.iter().enumerate().skip(1);
        let own: f64 = own.map(|(i, a)| a * before(&output, i)).sum();
        output.push(driven - own);
    }
    output
}

#[test]
fn the_difference_equation_gives_what_the_states_give() {
    let tf = TransferFunction::new(&[439.0, 35.08], &[1.523, 11.44, 1.0], 0.054).unwrap();
    let input: Vec<f64> = (0..400_u32).map(|k| f64::from((k * 7919) % 13)).collect();
    for (method, between) in [
        (DiscretisationMethod::ZeroOrderHold, Between::Held),
        (DiscretisationMethod::FirstOrderHold, Between::Linear),
    ] {
        let discrete = tf.discretise(DT_S, method).unwrap();
        let mut simulator = Simulator::new(&tf, DT_S, between).unwrap();
        for (a, u) in outputs(&discrete, &input).iter().zip(&input) {
            let b = simulator.step(*u);
            assert!((a - b).abs() < 1e-7, "{method:?} {a} {b}");
        }
    }
    let steady = simulate(&tf, &vec![1.0; 20_000], DT_S).unwrap();
    assert!((steady[19_999] - 35.08).abs() < 0.01);
}

#[test]
fn what_a_method_cannot_keep_is_refused() {
    let tf = TransferFunction::new(&[1.0, 2.0], &[1.0, 1.0], 0.0).unwrap();
    let late = tf.with_dead_time(0.054).unwrap();
    let words = late.discretise(DT_S, DiscretisationMethod::Bilinear).unwrap_err().to_string();
    assert!(words.contains("10.800 steps of 0.005 s"), "{words}");
    let whole = tf.with_dead_time(0.055).unwrap();
    assert_eq!(whole.discretise(DT_S, DiscretisationMethod::Bilinear).unwrap().delay, 11);
}
