//! Coefficients of the methods. The tests check their order conditions.

/// Explicit Runge-Kutta pair with seven stages, the last of which is the first of the next step.
pub(crate) struct ExplicitPair {
    /// Nodes: the times of the stages, as fractions of the step.
    pub c: [f64; 7],
    /// Row by row from the second stage on: weights of the stages before; the last row is the result of order 5.
    pub a: [[f64; 6]; 6],
    /// Result of order 5 minus result of order 4.
    pub error: [f64; 7],
    /// Weight of each stage at the fraction θ of the step: coefficients of θ, θ², θ³, θ⁴.
    pub dense: [[f64; 4]; 7],
}

/// Dormand & Prince, J. Comp. Appl. Math. 6 (1980), table 2; dense output of order 4: Shampine, Math. Comp. 46 (1986).
pub(crate) const DORMAND_PRINCE: ExplicitPair = ExplicitPair {
    c: [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0],
    a: [
        [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
        [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
        [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
        [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
        [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
    ],
    error: [
        71.0 / 57600.0,
        0.0,
        -71.0 / 16695.0,
        71.0 / 1920.0,
        -17253.0 / 339200.0,
        22.0 / 525.0,
        -1.0 / 40.0,
    ],
    dense: [
        [1.0, -8048581381.0 / 2820520608.0, 8663915743.0 / 2820520608.0, -12715105075.0 / 11282082432.0],
        [0.0; 4],
        [0.0, 131558114200.0 / 32700410799.0, -68118460800.0 / 10900136933.0, 87487479700.0 / 32700410799.0],
        [0.0, -1754552775.0 / 470086768.0, 14199869525.0 / 1410260304.0, -10690763975.0 / 1880347072.0],
        [
            0.0,
            127303824393.0 / 49829197408.0,
            -318862633887.0 / 49829197408.0,
            701980252875.0 / 199316789632.0,
        ],
        [0.0, -282668133.0 / 205662961.0, 2019193451.0 / 616988883.0, -1453857185.0 / 822651844.0],
        [0.0, 40617522.0 / 29380423.0, -110615467.0 / 29380423.0, 69997945.0 / 29380423.0],
    ],
};

/// One eigenvalue of the inverse of a collocation matrix (of a conjugate pair, the one above the real axis) with the coefficients of the
/// method along its eigenvector, as real and imaginary parts. A real eigenvalue contributes once, a pair twice its real part.
pub(crate) struct Eigenpart {
    /// The eigenvalue λ.
    pub value: [f64; 2],
    /// The eigenvector, one entry per stage; the last entry is one, so that the parts add up to the end of the step.
    pub vector: [[f64; 2]; 5],
    /// Component along the eigenvector of a right-hand side that is equal at all stages.
    pub constant: [f64; 2],
    /// Component along the eigenvector of a right-hand side that is proportional to the nodes.
    pub linear: [f64; 2],
    /// Weight in the error estimate.
    pub error: [f64; 2],
}

/// Radau IIA with five stages, order 9, in the eigenvectors of its inverse matrix (Hairer & Wanner, IV.5 and IV.8).
///
/// The error estimate is their eq. 8.19 for five stages, of order 5: it adds the start of the step with the weight 1/γ, γ the real
/// eigenvalue.
pub(crate) struct Collocation {
    /// Nodes: the times of the stages, as fractions of the step.
    pub nodes: [f64; 5],
    /// The real eigenvalue, then the two pairs.
    pub parts: [Eigenpart; 3],
}

/// Computed from the definition with 60 digits and rounded once.
pub(crate) const RADAU: Collocation = Collocation {
    nodes: [0.05710419611451768, 0.2768430136381238, 0.5835904323689168, 0.8602401356562195, 1.0],
    parts: [
        Eigenpart {
            value: [6.2867047517292765, 0.0],
            vector: [
                [0.013576867344947943, 0.0],
                [0.0016179004017190875, 0.0],
                [0.07915785334744721, 0.0],
                [0.41225608268046143, 0.0],
                [1.0, 0.0],
            ],
            constant: [43.479581157479, 0.0],
            linear: [6.916116292167072, 0.0],
            error: [-0.06782227007245038, 0.0],
        },
        Eigenpart {
            value: [3.655694325463572, 6.543736899360077],
            vector: [
                [-0.010242047817908826, -0.04767387729029572],
                [0.05017286451737106, 0.09433181918161143],
                [-0.23053953404341795, -0.1027030453801259],
                [0.37789390224886127, -0.46674413033249434],
                [1.0, 0.0],
            ],
            constant: [3.8396616302509052, -0.27357038626546526],
            linear: [0.21796823320280573, -0.464999807265731],
            error: [0.12402574114664287, 0.24182121622604447],
        },
        Eigenpart {
            value: [5.70095329867179, 3.2102656003085497],
            vector: [
                [-0.011478515255229515, 0.01401985889287541],
                [-0.007668830749180163, -0.024708578426518527],
                [0.01939846399882895, -0.08180035370375117],
                [0.40760117128019907, -0.19968242788680252],
                [1.0, 0.0],
            ],
            constant: [-25.079452208990404, 2.1872522937499967],
            linear: [-3.1760263792863417, 2.172117517210759],
            error: [0.04898618376957074, -0.07877168302631288],
        },
    ],
};

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Complex, SMatrix, SVector};

    #[test]
    fn dormand_prince_rows_sum_to_their_nodes() {
        for (row, c) in DORMAND_PRINCE.a.iter().zip(&DORMAND_PRINCE.c[1..]) {
            assert!((row.iter().sum::<f64>() - c).abs() < 1e-14);
        }
        assert!(DORMAND_PRINCE.error.iter().sum::<f64>().abs() < 1e-15);
    }

    /// Quadrature and two of the tree conditions up to order 5; the error weights have order 4.
    #[test]
    fn dormand_prince_holds_its_order_conditions() {
        let DormandPrince { b, c, a } = dormand_prince();
        let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-14, "{got} != {want}");
        for power in 0..5 {
            let moment: f64 = (0..7).map(|i| b[i] * c[i].powi(power)).sum();
            close(moment, 1.0 / f64::from(power + 1));
        }
        for power in 0..4 {
            let moment: f64 = (0..7).map(|i| DORMAND_PRINCE.error[i] * c[i].powi(power)).sum();
            close(moment, 0.0);
        }
        // b A^k c^m, the bushy trees on a stalk.
        let ac = a * c;
        close(b.dot(&ac), 1.0 / 6.0);
        close(b.dot(&(a * ac)), 1.0 / 24.0);
        close(b.dot(&(a * (a * ac))), 1.0 / 120.0);
        close(b.dot(&c.component_mul(&ac)), 1.0 / 8.0);
        close(b.dot(&(a * c.component_mul(&c))), 1.0 / 12.0);
    }

    #[test]
    fn dense_output_starts_at_the_start_and_ends_at_the_end() {
        let DormandPrince { b, c, .. } = dormand_prince();
        for (stage, polynomial) in DORMAND_PRINCE.dense.iter().enumerate() {
            let end: f64 = polynomial.iter().sum();
            assert!((end - b[stage]).abs() < 1e-14);
        }
        // Order 4 everywhere: the weights at θ integrate c^k up to θ.
        for theta in [0.3_f64, 0.7] {
            for power in 0..4 {
                let sum: f64 = (0..7)
                    .map(|i| {
                        let weight: f64 =
                            (0..4).map(|p| DORMAND_PRINCE.dense[i][p] * theta.powi(p as i32 + 1)).sum();
                        weight * c[i].powi(power)
                    })
                    .sum();
                let want = theta.powi(power + 1) / f64::from(power + 1);
                assert!((sum - want).abs() < 1e-13, "{power} {theta}: {sum} {want}");
            }
        }
    }

    struct DormandPrince {
        a: SMatrix<f64, 7, 7>,
        b: SVector<f64, 7>,
        c: SVector<f64, 7>,
    }

    fn dormand_prince() -> DormandPrince {
        let a = SMatrix::from_fn(|i, j| if i > 0 && j < 6 { DORMAND_PRINCE.a[i - 1][j] } else { 0.0 });
        DormandPrince { a, b: a.row(6).transpose(), c: SVector::from(DORMAND_PRINCE.c) }
    }

    /// The collocation matrix of the nodes: integrals of their Lagrange polynomials.
    fn collocation_matrix() -> SMatrix<f64, 5, 5> {
        let c = RADAU.nodes;
        let powers = SMatrix::<f64, 5, 5>::from_fn(|i, j| c[i].powi(j as i32));
        let integrals = SMatrix::<f64, 5, 5>::from_fn(|i, j| c[i].powi(j as i32 + 1) / (j as f64 + 1.0));
        integrals * powers.try_inverse().expect("distinct nodes")
    }

    #[test]
    fn radau_integrates_polynomials_of_degree_eight() {
        let weights = collocation_matrix().row(4).into_owned();
        for degree in 0..9 {
            let sum: f64 = (0..5).map(|i| weights[i] * RADAU.nodes[i].powi(degree)).sum();
            assert!((sum - 1.0 / f64::from(degree + 1)).abs() < 1e-14);
        }
        let ninth: f64 = (0..5).map(|i| weights[i] * RADAU.nodes[i].powi(9)).sum();
        assert!((ninth - 0.1).abs() > 1e-6, "Radau nodes, not Gauss nodes");
    }

    #[test]
    fn radau_parts_are_eigenvectors_and_resolve_the_right_hand_sides() {
        let matrix = collocation_matrix();
        let complex = |[re, im]: [f64; 2]| Complex::new(re, im);
        let mut constant = [0.0; 5];
        let mut linear = [0.0; 5];
        for (index, part) in RADAU.parts.iter().enumerate() {
            let multiplicity = if index == 0 { 1.0 } else { 2.0 };
            for row in 0..5 {
                // A v = v / λ
                let product: Complex<f64> = (0..5).map(|j| complex(part.vector[j]) * matrix[(row, j)]).sum();
                let want = complex(part.vector[row]) / complex(part.value);
                assert!((product - want).norm_sqr().sqrt() < 1e-14);
                constant[row] += multiplicity * (complex(part.vector[row]) * complex(part.constant)).re;
                linear[row] += multiplicity * (complex(part.vector[row]) * complex(part.linear)).re;
            }
        }
        for row in 0..5 {
            assert!((constant[row] - 1.0).abs() < 1e-13);
            assert!((linear[row] - RADAU.nodes[row]).abs() < 1e-13);
        }
    }

    /// The estimate `h f(0) / γ + Σ e Z` vanishes for polynomial solutions up to degree 5.
    #[test]
    fn radau_error_estimate_has_order_five() {
        let complex = |[re, im]: [f64; 2]| Complex::new(re, im);
        let columns = SMatrix::<Complex<f64>, 5, 5>::from_fn(|i, j| match j {
            0 => complex(RADAU.parts[0].vector[i]),
            1 => complex(RADAU.parts[1].vector[i]),
            2 => complex(RADAU.parts[1].vector[i]).conj(),
            3 => complex(RADAU.parts[2].vector[i]),
            _ => complex(RADAU.parts[2].vector[i]).conj(),
        });
        let inverse = columns.try_inverse().expect("independent eigenvectors");
        for degree in 1..=6 {
            let stages = SVector::<Complex<f64>, 5>::from_fn(|i, _| RADAU.nodes[i].powi(degree).into());
            let w = inverse * stages;
            let mut sum = if degree == 1 { 1.0 / RADAU.parts[0].value[0] } else { 0.0 };
            sum += (complex(RADAU.parts[0].error) * w[0]).re;
            sum += 2.0 * (complex(RADAU.parts[1].error) * w[1]).re;
            sum += 2.0 * (complex(RADAU.parts[2].error) * w[3]).re;
            if degree < 6 {
                assert!(sum.abs() < 1e-13, "{degree}: {sum}");
            } else {
                assert!(sum.abs() > 1e-4, "the estimate must see degree six");
            }
        }
    }
}
