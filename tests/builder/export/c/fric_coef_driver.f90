!> Calls fric_coef as Abaqus does: slip rate, pressure, scales of amplitude and frequency in; value
!! and derivatives out.
program driver
  implicit none
  real(8) :: line(4), coefficient(1, 2), slopes(1, 20, 2), slip(1, 6), nothing(8)
  integer :: status, numbers(6)
  character(80) :: name
  external :: fric_coef
  name = 'contact'
  numbers = 0
  nothing = 0
  do
    read (*, *, iostat=status) line
    if (status /= 0) exit
    coefficient = -1
    slopes = 0
    slip = 0
    slip(1, 1) = line(1)
    call fric_coef(coefficient, slopes, 1, 4, 1, 2, numbers, nothing, name, name, name, &
                   [0.3d0, 1d10, 2d-6, 1.3d5], &
                   slip, line(2:2), nothing(1:1), reshape(line(3:4), [1, 2]))
    write (*, '(3es25.16e3)') coefficient(1, 1), slopes(1, 1, 1), slopes(1, 2, 1)
  end do
end program driver

subroutine xit
  stop 1
end subroutine xit
