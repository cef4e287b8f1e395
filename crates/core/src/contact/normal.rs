//! Normal impact under near-field forces, (16)-(30).
//!
//! Phases: compression lasts dt1 = dt/(1 + e), recovery dt2 = e dt/(1 + e), (30). E1, E2: impulse of the field on a
//! particle along n_ij over the two phases [N s]. D = E_i/m_i - E_j/m_j over a phase [m/s]. u = v_in - v_jn > 0: approaching.
//! The energy that (26) takes from relative motion is the impact loss of the ledger.

/// One side of an impact, along the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// 1/m, zero for a wall [1/kg].
    pub inverse_mass: f64,
    /// Normal velocity before [m/s].
    pub velocity: f64,
    /// Field impulse over the compression phase, E1 [N s].
    pub compression: f64,
    /// Field impulse over the recovery phase, E2 [N s].
    pub recovery: f64,
}

/// Durations of compression and recovery, equation (30) [s].
#[must_use]
pub fn phases(duration: f64, e: f64) -> (f64, f64) {
    (duration / (1.0 + e), e * duration / (1.0 + e))
}

/// Normal velocities after the impact, equations (26) and (25) [m/s].
#[must_use]
pub fn velocities_after(i: &Side, j: &Side, e: f64) -> (f64, f64) {
    let u = i.velocity - j.velocity;
    let d1 = i.compression * i.inverse_mass - j.compression * j.inverse_mass;
    let d2 = i.recovery * i.inverse_mass - j.recovery * j.inverse_mass;
    // m_i/(m_i + m_j), m_j/(m_i + m_j) and 1/(m_i + m_j), written for a wall's infinite mass too.
    let total = i.inverse_mass + j.inverse_mass;
    let (share_i, share_j) = (j.inverse_mass / total, i.inverse_mass / total);
    let inverse_sum = i.inverse_mass * j.inverse_mass / total;
    let field = i.compression + i.recovery + j.compression + j.recovery;
    let v_i = share_i * i.velocity + share_j * (j.velocity - e * u) + field * inverse_sum - share_j * (e * d1 - d2);
    let v_j = v_i - d2 + e * (u + d1);
    (v_i, v_j)
}

/// Impulse of the contact, -I_n dt >= 0 pushing the two apart [N s].
///
/// This is (28) with (26) put in: -I_n dt = m_eff (1 + e) (u + D1); the recovery phase drops out. It is clamped at zero
/// where a strong repulsion would make it negative: no contact pulls.
#[must_use]
pub fn impulse(i: &Side, j: &Side, e: f64) -> f64 {
    let u = i.velocity - j.velocity;
    let d1 = i.compression * i.inverse_mass - j.compression * j.inverse_mass;
    ((1.0 + e) * (u + d1) / (i.inverse_mass + j.inverse_mass)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::{Side, impulse, phases, velocities_after};

    fn side(mass: f64, velocity: f64, force: f64, (dt1, dt2): (f64, f64)) -> Side {
        Side { inverse_mass: 1.0 / mass, velocity, compression: force * dt1, recovery: force * dt2 }
    }

    /// With one mean force for both phases e D1 = D2, so the outcome is Newton's law plus the field's own impulse.
    #[test]
    fn the_d_terms_of_26_cancel_for_a_common_force() {
        for e in [0.0, 0.3, 1.0] {
            for (m_i, m_j) in [(1.0, 1.0), (1.0, 1e6), (3.0, 0.2)] {
                let times = phases(1e-3, e);
                let (i, j) = (side(m_i, 2.0, 5.0, times), side(m_j, -1.0, -7.0, times));
                let (v_i, v_j) = velocities_after(&i, &j, e);
                let u = 3.0;
                // Separation e u: relative velocity after, whatever the field.
                assert!((v_j - v_i - e * u).abs() <= 4e-15 * u, "{e} {m_i} {m_j}");
                let momentum = m_i * v_i + m_j * v_j - (2.0 * m_i - m_j) - (5.0 - 7.0) * 1e-3;
                assert!(momentum.abs() <= 1e-15 * 3.0 * (m_i + m_j));
            }
        }
    }

    /// The closed form of the impulse against (28): m_i (v_i' - v_i) - E_i, with different forces in the two phases.
    #[test]
    fn the_impulse_is_28_with_26_put_in() {
        for e in [0.0, 0.5, 0.9] {
            for inverse_mass_j in [0.0, 0.25, 2.0] {
                let i = Side { inverse_mass: 0.5, velocity: 1.5, compression: 0.3, recovery: -0.1 };
                let j = if inverse_mass_j == 0.0 {
                    Side { inverse_mass: 0.0, velocity: 0.0, compression: 0.0, recovery: 0.0 }
                } else {
                    Side { inverse_mass: inverse_mass_j, velocity: -0.5, compression: -0.2, recovery: 0.4 }
                };
                let (v_i, v_j) = velocities_after(&i, &j, e);
                let from_i = (v_i - i.velocity) / i.inverse_mass - (i.compression + i.recovery);
                assert!((impulse(&i, &j, e) + from_i).abs() <= 1e-14, "{e} {inverse_mass_j}");
                if inverse_mass_j > 0.0 {
                    let from_j = (v_j - j.velocity) / j.inverse_mass - (j.compression + j.recovery);
                    assert!((impulse(&i, &j, e) - from_j).abs() <= 1e-14);
                }
            }
        }
    }

    #[test]
    fn no_contact_pulls() {
        let times = phases(1e-2, 0.5);
        let repelled = side(1.0, 0.1, -100.0, times);
        let other = side(1.0, -0.1, 100.0, times);
        assert_eq!(impulse(&repelled, &other, 0.5), 0.0);
    }
}
