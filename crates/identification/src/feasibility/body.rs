//! Rigid body with its ten parameters, and the test of its physical consistency.

use nalgebra::{Cholesky, Matrix3, Matrix4, Vector3};

/// Ten parameters of a link: mass \[kg\], first moments \[kg·m\] and inertia \[kg·m²\] about the
/// origin of the link's frame. They may be inconsistent: [`is_possible`](Self::is_possible) checks
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// Mass times centre of mass \[kg·m\].
    pub first_moment: Vector3<f64>,
    /// Inertia about the origin of the link's frame \[kg·m²\]: the matrix, whose entry xy is minus
    /// the integral of xy.
    pub inertia: Matrix3<f64>,
}

impl Body {
    /// Creates a body from the parameters in the order of
    /// [`ParameterKind::LINK`](didim_dynamics::robot::ParameterKind::LINK): xx xy xz yy yz zz mx my
    /// mz m.
    pub fn from_parameters([xx, xy, xz, yy, yz, zz, mx, my, mz, m]: [f64; 10]) -> Self {
        Self {
            mass_kg: m,
            first_moment: Vector3::new(mx, my, mz),
            inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        }
    }

    /// Returns the parameters in the same order.
    pub fn parameters(&self) -> [f64; 10] {
        let (i, h) = (&self.inertia, &self.first_moment);
        let (xx, yy, zz) = (i[(0, 0)], i[(1, 1)], i[(2, 2)]);
        [xx, i[(0, 1)], i[(0, 2)], yy, i[(1, 2)], zz, h.x, h.y, h.z, self.mass_kg]
    }

    /// Returns P = \[Σ, h; hᵀ, m\] with the first moments h and Σ = ½ tr(I) 1 − I, the integral of
    /// r rᵀ.
    pub fn pseudo_inertia(&self) -> Matrix4<f64> {
        let mut pseudo = Matrix4::zeros();
        let second = Matrix3::identity() * (0.5 * self.inertia.trace()) - self.inertia;
        pseudo.fixed_view_mut::<3, 3>(0, 0).copy_from(&second);
        pseudo.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.first_moment);
        pseudo.fixed_view_mut::<1, 3>(3, 0).copy_from(&self.first_moment.transpose());
        pseudo[(3, 3)] = self.mass_kg;
        pseudo
    }

    /// Creates the body of a pseudo-inertia: I = tr(Σ) 1 − Σ.
    pub fn from_pseudo_inertia(pseudo: &Matrix4<f64>) -> Self {
        let second = pseudo.fixed_view::<3, 3>(0, 0);
        Self {
            mass_kg: pseudo[(3, 3)],
            first_moment: pseudo.fixed_view::<3, 1>(0, 3).into_owned(),
            inertia: Matrix3::identity() * second.trace() - second,
        }
    }

    /// Returns the centre of mass \[m\] of a body that has mass.
    pub fn centre_of_mass_m(&self) -> Option<Vector3<f64>> {
        (self.mass_kg > 0.0).then(|| self.first_moment / self.mass_kg)
    }

    /// Returns the inertia about the centre of mass \[kg·m²\], I − m (cᵀc 1 − c cᵀ), of a body that
    /// has mass.
    pub fn inertia_about_centre(&self) -> Option<Matrix3<f64>> {
        let c = self.centre_of_mass_m()?;
        Some(
            self.inertia
                - (Matrix3::identity() * c.norm_squared() - c * c.transpose()) * self.mass_kg,
        )
    }

    /// Returns the smallest eigenvalue of the second moments about the centre of mass, divided by
    /// their sum. It is 1/3 for a ball and 0 for a plate without thickness. It is not positive if
    /// no such body exists. P ≻ 0 is equivalent to a positive mass and a positive value of this
    /// ratio (Schur's complement). Returns `None` without a positive mass.
    pub fn least_extent(&self) -> Option<f64> {
        let inertia = self.inertia_about_centre()?;
        let sum = 0.5 * inertia.trace();
        let second = Matrix3::identity() * sum - inertia;
        let least = second.symmetric_eigenvalues().min() / sum.abs();
        least.is_finite().then_some(least)
    }

    /// Returns true if P ≻ 0: a positive mass, a centre, positive inertia and the triangle
    /// inequality at once.
    pub fn is_possible(&self) -> bool {
        self.least_extent().is_some_and(|extent| extent > 0.0)
    }

    /// Returns the smallest eigenvalue of L⁻¹ P L⁻ᵀ, with P⁰ = L Lᵀ of a prior body. It is 1 for
    /// the prior itself, in any units, and positive if and only if P ≻ 0. Returns `None` if the
    /// prior is not a physically consistent body.
    pub fn eigenvalue_relative_to(&self, prior: &Self) -> Option<f64> {
        let factor = Cholesky::new(prior.pseudo_inertia())?.l();
        let half = factor.solve_lower_triangular(&self.pseudo_inertia())?;
        let whitened = factor.solve_lower_triangular(&half.transpose())?;
        Some(whitened.symmetric_eigenvalues().min())
    }

    /// Creates a homogeneous ball about a point.
    pub(super) fn ball(mass_kg: f64, radius: f64, middle: Vector3<f64>) -> Self {
        let second = Matrix3::identity() * (radius * radius / 5.0) + middle * middle.transpose();
        Self::from_second_moments(mass_kg, &second, middle)
    }

    /// Creates a homogeneous cylinder of this length about an axis (a unit vector), centred at
    /// `middle`.
    pub(super) fn cylinder(
        mass_kg: f64,
        radius: f64,
        length: f64,
        middle: Vector3<f64>,
        axis: Vector3<f64>,
    ) -> Self {
        let (along, across) = (length * length / 12.0, radius * radius / 4.0);
        let second = axis * axis.transpose() * (along - across)
            + Matrix3::identity() * across
            + middle * middle.transpose();
        Self::from_second_moments(mass_kg, &second, middle)
    }

    /// Creates a body from its mass, the mean of r rᵀ over its mass, and its centre.
    fn from_second_moments(mass_kg: f64, second: &Matrix3<f64>, middle: Vector3<f64>) -> Self {
        let mut pseudo = Matrix4::zeros();
        pseudo.fixed_view_mut::<3, 3>(0, 0).copy_from(&(second * mass_kg));
        pseudo.fixed_view_mut::<3, 1>(0, 3).copy_from(&(middle * mass_kg));
        pseudo.fixed_view_mut::<1, 3>(3, 0).copy_from(&(middle * mass_kg).transpose());
        pseudo[(3, 3)] = mass_kg;
        Self::from_pseudo_inertia(&pseudo)
    }
}
