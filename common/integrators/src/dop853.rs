//! Dormand & Prince, order 8 with error estimates of orders 5 and 3.
//!
//! Twelve evaluations per step. With the sizes `e_5`, `e_3` of the two estimates
//! ```text
//! err = e_5^2 / sqrt(e_5^2 + 0.01 e_3^2)                                  = O(h^8)
//! ```
//! The continuous extension of order 7 needs the slope at the new state, which starts the next step, and three stages
//! more, evaluated only when somebody looks:
//! ```text
//! x(theta) = x_0 + theta (F_1 + (1 - theta) (F_2 + theta (F_3 + (1 - theta) (F_4 + theta (F_5 + (1 - theta) (F_6 + theta F_7))))))
//! F_1 = x_1 - x_0,   F_2 = h k_1 - F_1,   F_3 = 2 F_1 - h (k_1 + k_13),   F_(4+i) = h sum_j d_ij k_j
//! ```
//! Source: Hairer, Nørsett & Wanner, sections II.5, II.6 and II.10 (P. J. Prince, J. R. Dormand, J. Comp. Appl. Math. 7
//! (1981)); coefficients of the code DOP853 of E. Hairer and G. Wanner.

use crate::one_step::{Call, Estimate, OneStep, Start};
use crate::pace::Pace;
use crate::{Complex, Dense, Ode, StepError};

/// Nonzero weights with the stages they belong to.
pub(crate) type Row = &'static [(usize, f64)];

/// Rows 2 to 12 of `a`: nonzero entries with their columns.
pub(crate) const A: [Row; 11] = [
    &[(0, 0.052_600_151_958_767_73)],
    &[(0, 0.019_725_056_984_537_9), (1, 0.059_175_170_953_613_7)],
    &[(0, 0.029_587_585_476_806_85), (2, 0.088_762_756_430_420_54)],
    &[(0, 0.241_365_134_159_266_7), (2, -0.884_549_479_328_286_1), (3, 0.924_834_003_261_792)],
    &[(0, 0.037_037_037_037_037_035), (3, 0.170_828_608_729_473_86), (4, 0.125_467_687_566_822_42)],
    &[(0, 0.037_109_375), (3, 0.170_252_211_019_544_05), (4, 0.060_216_538_980_455_96), (5, -0.017_578_125)],
    &[
        (0, 0.037_092_000_118_504_79),
        (3, 0.170_383_925_712_239_98),
        (4, 0.107_262_030_446_373_28),
        (5, -0.015_319_437_748_624_402),
        (6, 0.008_273_789_163_814_023),
    ],
    &[
        (0, 0.624_110_958_716_075_7),
        (3, -3.360_892_629_446_941_4),
        (4, -0.868_219_346_841_726),
        (5, 27.592_099_699_446_71),
        (6, 20.154_067_550_477_894),
        (7, -43.489_884_181_069_96),
    ],
    &[
        (0, 0.477_662_536_438_264_34),
        (3, -2.488_114_619_971_667_7),
        (4, -0.590_290_826_836_843),
        (5, 21.230_051_448_181_193),
        (6, 15.279_233_632_882_423),
        (7, -33.288_210_968_984_86),
        (8, -0.020_331_201_708_508_627),
    ],
    &[
        (0, -0.937_142_430_085_987_3),
        (3, 5.186_372_428_844_064),
        (4, 1.091_437_348_996_729_5),
        (5, -8.149_787_010_746_927),
        (6, -18.520_065_659_996_96),
        (7, 22.739_487_099_350_505),
        (8, 2.493_605_552_679_652_3),
        (9, -3.046_764_471_898_219_6),
    ],
    &[
        (0, 2.273_310_147_516_538),
        (3, -10.534_495_466_737_25),
        (4, -2.000_872_058_224_862_5),
        (5, -17.958_931_863_118_8),
        (6, 27.948_884_529_419_96),
        (7, -2.858_998_277_135_023_5),
        (8, -8.872_856_933_530_63),
        (9, 12.360_567_175_794_303),
        (10, 0.643_392_746_015_763_6),
    ],
];

pub(crate) const B: Row = &[
    (0, 0.054_293_734_116_568_765),
    (5, 4.450_312_892_752_409),
    (6, 1.891_517_899_314_500_3),
    (7, -5.801_203_960_010_585),
    (8, 0.311_164_366_957_819_9),
    (9, -0.152_160_949_662_516_1),
    (10, 0.201_365_400_804_030_34),
    (11, 0.044_710_615_727_772_59),
];

pub(crate) const C: [f64; 11] = [
    0.052_600_151_958_767_73,
    0.078_900_227_938_151_6,
    0.118_350_341_907_227_4,
    0.281_649_658_092_772_6,
    0.333_333_333_333_333_3,
    0.25,
    0.307_692_307_692_307_7,
    0.651_282_051_282_051_3,
    0.6,
    0.857_142_857_142_857_1,
    1.0,
];

/// Weights minus those of the embedded method of order 5.
pub(crate) const ERROR_5: Row = &[
    (0, 0.013_120_044_994_194_88),
    (5, -1.225_156_446_376_204_4),
    (6, -0.495_758_949_657_250_2),
    (7, 1.664_377_182_454_986_4),
    (8, -0.350_328_848_749_973_66),
    (9, 0.334_179_118_713_017_5),
    (10, 0.081_923_206_485_115_71),
    (11, -0.022_355_307_863_886_294),
];

/// The other embedded method, of order 3, has three weights.
pub(crate) const WEIGHTS_3: Row =
    &[(0, 0.244_094_488_188_976_4), (8, 0.733_846_688_281_611_8), (11, 0.022_058_823_529_411_766)];

/// Rows of the three further stages of the continuous extension; stage 13 is the slope at the new state.
pub(crate) const A_DENSE: [Row; 3] = [
    &[
        (0, 0.056_167_502_283_047_954),
        (6, 0.253_500_210_216_624_83),
        (7, -0.246_239_037_470_802_5),
        (8, -0.124_191_423_263_816_37),
        (9, 0.153_291_798_278_765_68),
        (10, 0.008_201_052_295_634_69),
        (11, 0.007_567_897_660_545_699),
        (12, -0.008_298),
    ],
    &[
        (0, 0.031_834_648_163_502_14),
        (5, 0.028_300_909_672_366_776),
        (6, 0.053_541_988_307_438_566),
        (7, -0.054_923_748_571_390_99),
        (10, -0.000_108_347_328_697_249_32),
        (11, 0.000_382_571_090_835_658_4),
        (12, -0.000_340_465_008_687_404_56),
        (13, 0.141_312_443_674_632_5),
    ],
    &[
        (0, -0.428_896_301_583_791_94),
        (5, -4.697_621_415_361_164),
        (6, 7.683_421_196_062_599),
        (7, 4.068_989_818_397_11),
        (8, 0.356_727_187_455_281_1),
        (12, -0.001_399_024_165_159_014_5),
        (13, 2.947_514_789_152_772_4),
        (14, -9.150_958_472_179_87),
    ],
];

pub(crate) const C_DENSE: [f64; 3] = [0.1, 0.2, 0.777_777_777_777_777_8];

/// Weights of its last four terms.
pub(crate) const D: [Row; 4] = [
    &[
        (0, -8.428_938_276_109_013),
        (5, 0.566_714_953_519_377_7),
        (6, -3.068_949_945_949_891_7),
        (7, 2.384_667_656_512_07),
        (8, 2.117_034_582_445_028),
        (9, -0.871_391_583_777_973),
        (10, 2.240_437_430_260_788_3),
        (11, 0.631_578_778_769_468_8),
        (12, -0.088_990_336_451_333_31),
        (13, 18.148_505_520_854_727),
        (14, -9.194_632_392_478_356),
        (15, -4.436_036_387_594_894),
    ],
    &[
        (0, 10.427_508_642_579_134),
        (5, 242.283_491_775_258_17),
        (6, 165.200_451_717_270_28),
        (7, -374.546_754_722_690_2),
        (8, -22.113_666_853_125_306),
        (9, 7.733_432_668_472_264),
        (10, -30.674_084_731_089_398),
        (11, -9.332_130_526_430_229),
        (12, 15.697_238_121_770_845),
        (13, -31.139_403_219_565_178),
        (14, -9.352_924_358_844_48),
        (15, 35.816_841_486_394_08),
    ],
    &[
        (0, 19.985_053_242_002_433),
        (5, -387.037_308_749_351_8),
        (6, -189.178_138_195_167_58),
        (7, 527.808_159_205_423_6),
        (8, -11.573_902_539_959_63),
        (9, 6.881_232_694_696_3),
        (10, -1.000_605_096_691_083_8),
        (11, 0.777_713_779_805_344_3),
        (12, -2.778_205_752_353_508),
        (13, -60.196_695_231_264_12),
        (14, 84.320_405_506_677_16),
        (15, 11.992_291_136_182_79),
    ],
    &[
        (0, -25.693_933_462_703_75),
        (5, -154.189_748_690_236_43),
        (6, -231.529_379_176_045_5),
        (7, 357.639_117_910_614_1),
        (8, 93.405_324_183_624_32),
        (9, -37.458_323_136_451_63),
        (10, 104.099_649_508_962_3),
        (11, 29.840_293_426_660_5),
        (12, -43.533_456_590_011_14),
        (13, 96.324_553_959_188_28),
        (14, -39.177_261_675_615_44),
        (15, -149.726_836_257_985_64),
    ],
];

pub(crate) const PACE: Pace = Pace { order: 8.0, beta: 0.0, shrink: 1.0 / 3.0, grow: 6.0, predictive: false };

/// Evaluations per step, and stages with those of the continuous extension.
pub(crate) const STAGES: usize = 12;
pub(crate) const ALL_STAGES: usize = 16;

/// The method.
pub(crate) struct Dop853;

impl Dop853 {
    pub(crate) const ORDER: u32 = 8;
    #[allow(clippy::cast_possible_truncation, reason = "12")]
    pub(crate) const EVALUATIONS: u32 = STAGES as u32;

    /// `R(z) = 1 + z b^T k` with the stages `k_i = 1 + z sum_j a_ij k_j` of `x' = lambda x`.
    pub(crate) fn stability(z: Complex) -> Complex {
        let one = Complex::new(1.0, 0.0);
        let mut k = [one; STAGES];
        let sum = |row: Row, k: &[Complex; STAGES]| {
            one + z * row.iter().fold(Complex::default(), |sum, &(j, w)| sum + w * k[j])
        };
        for (i, row) in A.iter().enumerate() {
            k[i + 1] = sum(row, &k);
        }
        sum(B, &k)
    }
}

/// `h sum_j weights_j k_j`
#[inline]
fn combine<const N: usize>(h: f64, weights: Row, k: &[[f64; N]; ALL_STAGES]) -> [f64; N] {
    let mut sum = [0.0; N];
    for &(j, w) in weights {
        for (sum, k) in sum.iter_mut().zip(&k[j]) {
            *sum += w * k;
        }
    }
    sum.map(|sum| h * sum)
}

#[inline]
fn moved<const N: usize>(x: &[f64; N], by: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| x[i] + by[i])
}

/// One error from the sizes of the two estimates.
pub(crate) fn joined(e_5: f64, e_3: f64) -> f64 {
    if e_5 > 0.0 {
        e_5 * e_5 / (e_5 * e_5 + 0.01 * e_3 * e_3).sqrt()
    } else {
        e_5 // zero, or not a number
    }
}

/// New state and stages of one step.
pub(crate) struct Trial<const N: usize> {
    x: [f64; N],
    k: [[f64; N]; ALL_STAGES],
    /// Stages 13 to 16 are there.
    extended: bool,
}

impl<const N: usize> OneStep<N> for Dop853 {
    type Trial = Trial<N>;
    type Work = ();

    fn pace(&self) -> Pace {
        PACE
    }

    #[inline]
    fn step<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, ()>,
        from: &Start<N>,
        h: f64,
    ) -> Result<Trial<N>, StepError<O::Error>> {
        let mut k = [[0.0; N]; ALL_STAGES];
        k[0] = from.slope;
        for i in 1..STAGES {
            let x = moved(&from.x, &combine(h, A[i - 1], &k));
            k[i] = call.rhs(from.t + C[i - 1] * h, &x)?;
        }
        Ok(Trial { x: moved(&from.x, &combine(h, B, &k)), k, extended: false })
    }

    fn state(trial: &Trial<N>) -> &[f64; N] {
        &trial.x
    }

    fn slope<'a>(&self, trial: &'a Trial<N>) -> Option<&'a [f64; N]> {
        trial.extended.then(|| &trial.k[STAGES])
    }

    #[inline]
    fn error<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, ()>,
        from: &Start<N>,
        trial: &Trial<N>,
        h: f64,
        _fresh: bool,
    ) -> Estimate<N> {
        let parts = combine(h, ERROR_5, &trial.k);
        let embedded = combine(h, WEIGHTS_3, &trial.k);
        let third: [f64; N] = std::array::from_fn(|i| trial.x[i] - from.x[i] - embedded[i]);
        let [e_5, e_3] = [&parts, &third].map(|e| call.norm.of(e, &from.x, &trial.x));
        Estimate { size: joined(e_5, e_3), parts }
    }

    fn dense<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, ()>,
        from: &Start<N>,
        trial: &mut Trial<N>,
        h: f64,
    ) -> Result<Dense<N>, StepError<O::Error>> {
        let Start { t, x, slope } = from;
        trial.k[STAGES] = call.rhs(t + h, &trial.x)?;
        for (i, (row, c)) in A_DENSE.iter().zip(C_DENSE).enumerate() {
            let x = moved(x, &combine(h, row, &trial.k));
            trial.k[STAGES + 1 + i] = call.rhs(t + c * h, &x)?;
        }
        trial.extended = true;
        let f_1: [f64; N] = std::array::from_fn(|i| trial.x[i] - x[i]);
        let f_2 = std::array::from_fn(|i| h * slope[i] - f_1[i]);
        let f_3 = std::array::from_fn(|i| 2.0 * f_1[i] - h * (slope[i] + trial.k[STAGES][i]));
        let [f_4, f_5, f_6, f_7] = D.map(|row| combine(h, row, &trial.k));
        Ok(Dense::new(from, h, trial.x, &powers_of_theta(&[f_1, f_2, f_3, f_4, f_5, f_6, f_7])))
    }
}

/// The extension sorted by powers of theta: from the inside, times `theta` and `1 - theta` in turn.
pub(crate) fn powers_of_theta<const N: usize>(f: &[[f64; N]; 7]) -> [[f64; N]; 7] {
    let mut p = [[0.0; N]; 8];
    for (i, f) in f.iter().enumerate().rev() {
        p[0] = moved(&p[0], f);
        let by_theta = i % 2 == 0;
        for q in (0..7).rev() {
            let lower = p[q];
            p[q + 1] = if by_theta { lower } else { std::array::from_fn(|n| p[q + 1][n] - lower[n]) };
        }
        if by_theta {
            p[0] = [0.0; N];
        }
    }
    std::array::from_fn(|q| p[q + 1])
}

#[cfg(test)]
mod tests;
