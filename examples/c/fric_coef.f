c     Abaqus/Standard: mu_macro of a contact that is oscillated transversely, with its derivatives
c     by slip rate and pressure.  Interface of the releases from 2020 on; link with mumacro.f90,
c     mumacro.c and mumacro_table.c.
c
c     *Friction, user=COEFFICIENT, properties=4
c     mu0 [-], k [N/m^3], y0 [m], omega [rad/s]
c
c     k is the tangential stiffness per area of the contact: a pressure stands for the force, so
c     y~ = y0 k/(mu0 p).  The first field variable, where there is one, scales y0; the second scales
c     omega: the oscillation's amplitude and frequency in place and time.  The slip rate that the
c     model sees must be the mean over a period of the oscillation: do not resolve the oscillation
c     itself in the same analysis.
      subroutine fric_coef(fCoef, fCoefDeriv, nBlock, nProps, nTemp,
     &     nFields, iData, rData, surfInt, surfSec, surfMain, props,
     &     slipData, pressure, tempAvg, fieldAvg)
      use, intrinsic :: iso_c_binding, only: c_double
      use, intrinsic :: ieee_arithmetic
      use mumacro
      include 'aba_param.inc'
      dimension fCoef(nBlock,2), fCoefDeriv(nBlock,20,2), props(nProps),
     &     slipData(nBlock,6), pressure(nBlock), tempAvg(nBlock),
     &     fieldAvg(nBlock,nFields), iData(*), rData(*)
      character*80 surfInt, surfSec, surfMain
      parameter (iSlipRate = 1, iPressure = 2)
      type(mumacro_answer) :: a
      real(c_double) :: load, stiffness, y0, omega
      integer :: i, ierror

      do i = 1, nBlock
         y0 = props(3)
         omega = props(4)
         if (nFields >= 1) y0 = y0*fieldAvg(i, 1)
         if (nFields >= 2) omega = omega*fieldAvg(i, 2)
c        without pressure the contact is rigid beside its load
         load = pressure(i)
         stiffness = props(2)
         if (load <= 0) then
            load = 1
            stiffness = ieee_value(stiffness, ieee_positive_inf)
         end if
         ierror = mumacro_evaluate(real(props(1), c_double), load,
     &        stiffness, y0, omega, real(slipData(i, iSlipRate),
     &        c_double), a)
         if (ierror /= 0) then
            write (*, *) 'fric_coef: illegal input ', ierror
            call xit
         end if
         fCoef(i, 1) = a%mu_macro
         fCoefDeriv(i, iSlipRate, 1) = a%gradient(6)
         fCoefDeriv(i, iPressure, 1) = a%gradient(2)
c        at rest on y~ = 1 and for rigid contact the slope is infinite
         if (.not. ieee_is_finite(a%gradient(6)))
     &        fCoefDeriv(i, iSlipRate, 1) = 0
      end do
      end subroutine fric_coef
