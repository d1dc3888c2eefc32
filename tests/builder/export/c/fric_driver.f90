!> Calls fric and vfric as Abaqus does.  A line of input: pressure, step of time, slip increments
!! along both directions; out: stresses, their derivatives by the increments and by pressure,
!! dissipation.  Without slip: vfric at 3 nodes.
program driver
  implicit none
  real(8) :: line(4), tau(2), ddg(2, 2), ddp(2), slip(2), t2(2, 2), sfd, sed, x(99)
  real(8) :: tangential(2, 3), stick(3), area(5), normal(3)
  integer :: status, lm, ids(99)
  character(80) :: name
  external :: fric, vfric
  name = 'contact'
  do
    read (*, *, iostat=status) line
    if (status /= 0) exit
    x = 0
    ids = 0
    lm = 2
    sfd = 0
    call fric(lm, tau, ddg, ddp, slip, sed, sfd, t2, x(1), x, line(3:4), x, line(1), x(1), x(1), &
              x, 1, 1, x, line(2), 1, name, name, name, 1, 1, 1, x, x, x, x, x, 2, 3, 1, 1, x(1), &
              [0.3d0, 1d10, 2d-6, 1.3d5, 1d-3], 5)
    write (*, '(9es25.16e3,i3)') tau, ddg, ddp, sfd, lm
    if (any(line(3:4) /= 0)) cycle
    area = [1d-4, 2d-4, 1d-4, 0d0, 1d-4]
    normal = [10d0, 10d0, 0d0]
    stick = [1d3, 1d-2, 1d3]
    ids(1:3) = [2, 1, 3]
    tangential = 7
    call vfric(tangential, x, 1, 1, 3, 1, 5, 1, 2, 3, 1, 4, 1, 1, 1, ids(9:), ids(9:), ids, &
               ids(9:), 1d-3, 0d0, 1d-3, name, name, name, 1, &
               [1d-5, 0d0, 0d0, 1d-5, 0d0, 0d0, 1d-5, 0d0, 0d0], stick, x, normal, x(1), x, x, x, &
               x, x, [0.3d0, 1d10, 2d-6, 1.3d5], area, x, x, x, x)
    write (*, '(6es25.16e3)') tangential
  end do
end program driver
