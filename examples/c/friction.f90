!> Six numbers a line in (mu0 Fz k y0 omega v0, SI), mu_macro, its bound, the gradient, power and
!! stick fraction out.
program friction
  use, intrinsic :: iso_c_binding, only: c_double, c_int
  use, intrinsic :: iso_fortran_env, only: error_unit
  use mumacro
  implicit none
  real(c_double) :: x(6)
  type(mumacro_answer) :: a
  type(mumacro_cycle) :: c
  integer(c_int) :: error
  integer :: status

  do
    read (*, *, iostat=status) x
    if (status /= 0) exit
    error = mumacro_evaluate(x(1), x(2), x(3), x(4), x(5), x(6), a)
    if (error /= 0) then
      write (error_unit, '(a, i0, a, es12.5)') 'input ', error, ' is illegal: ', x(error)
      stop 1
    end if
    error = mumacro_evaluate_cycle(x(1), x(2), x(3), x(4), x(5), x(6), c)
    write (*, '(*(es25.16e3))') a%mu_macro, a%error_bound, a%gradient, c%power, c%stick_fraction
  end do
end program friction
