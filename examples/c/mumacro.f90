!> Macroscopic friction of an oscillated sliding contact: the functions of mumacro.h.
!! Fortran 2003.  Link with mumacro.c and mumacro_table.c; mumacro.h explains every function and
!! its units.
module mumacro
  use, intrinsic :: iso_c_binding, only: c_double, c_int
  implicit none
  private
  public :: mumacro_answer, mumacro_cycle, mumacro_evaluate, mumacro_evaluate_cycle
  public :: mumacro_mu_macro, mumacro_mu_ratio, mumacro_v_tilde_crit, mumacro_power
  public :: mumacro_stick_fraction, mumacro_force
  public :: mumacro_evaluate_force

  !> Answer to a case; the gradient is in the order mu0, Fz, k, y0, omega, v0.
  type, bind(c) :: mumacro_answer
    real(c_double) :: mu_macro, mu_ratio, error_bound, v_tilde, y_tilde
    integer(c_int) :: source, regime
    real(c_double) :: gradient(6), gradient_bound(6)
  end type mumacro_answer

  type, bind(c) :: mumacro_cycle
    real(c_double) :: v0_crit, power, power_bound, stick_fraction, stick_fraction_bound
  end type mumacro_cycle

  interface
    !> 0, or 1 + the place of the first illegal input.
    function mumacro_evaluate(mu0, Fz, k, y0, omega, v0, answer) result(error) bind(c)
      import :: c_double, c_int, mumacro_answer
      real(c_double), value :: mu0, Fz, k, y0, omega, v0
      type(mumacro_answer), intent(out) :: answer
      integer(c_int) :: error
    end function mumacro_evaluate

    function mumacro_evaluate_cycle(mu0, Fz, k, y0, omega, v0, cycle) result(error) bind(c)
      import :: c_double, c_int, mumacro_cycle
      real(c_double), value :: mu0, Fz, k, y0, omega, v0
      type(mumacro_cycle), intent(out) :: cycle
      integer(c_int) :: error
    end function mumacro_evaluate_cycle

    !> NaN where illegal, as the functions below.
    pure function mumacro_mu_macro(mu0, Fz, k, y0, omega, v0) result(mu) bind(c)
      import :: c_double
      real(c_double), value :: mu0, Fz, k, y0, omega, v0
      real(c_double) :: mu
    end function mumacro_mu_macro

    pure function mumacro_mu_ratio(v_tilde, y_tilde) result(mu) bind(c)
      import :: c_double
      real(c_double), value :: v_tilde, y_tilde
      real(c_double) :: mu
    end function mumacro_mu_ratio

    pure function mumacro_power(v_tilde, y_tilde) result(power) bind(c)
      import :: c_double
      real(c_double), value :: v_tilde, y_tilde
      real(c_double) :: power
    end function mumacro_power

    pure function mumacro_stick_fraction(v_tilde, y_tilde) result(share) bind(c)
      import :: c_double
      real(c_double), value :: v_tilde, y_tilde
      real(c_double) :: share
    end function mumacro_stick_fraction

    !> Friction force [N] for time integration at any v0 [m/s], regularised below v_rest.
    pure function mumacro_force(v0, v_rest, mu0, Fz, k, y0, omega) result(force) bind(c)
      import :: c_double
      real(c_double), value :: v0, v_rest, mu0, Fz, k, y0, omega
      real(c_double) :: force
    end function mumacro_force

    !> The same for a contact and a direction, 0 and 0 for one spring across, with its gradient; 0,
    !! or an error.
    function mumacro_evaluate_force( &
        contact, direction, v0, v_rest, mu0, Fz, k, y0, omega, force, gradient) &
        result(error) bind(c)
      import :: c_double, c_int
      integer(c_int), value :: contact, direction
      real(c_double), value :: v0, v_rest, mu0, Fz, k, y0, omega
      real(c_double), intent(out) :: force, gradient(6)
      integer(c_int) :: error
    end function mumacro_evaluate_force

    pure function mumacro_v_tilde_crit(y_tilde) result(crit) bind(c)
      import :: c_double
      real(c_double), value :: y_tilde
      real(c_double) :: crit
    end function mumacro_v_tilde_crit
  end interface
end module mumacro
