c     Abaqus/Standard: the whole shear stress of a contact that is oscillated transversely, with its
c     derivatives. Link with mumacro.f90, mumacro.c and mumacro_table.c.
c
c     *Friction, user, properties=5
c     mu0 [-], k [N/m^3], y0 [m], omega [rad/s], v_rest [m/s]
c
c     k is the tangential stiffness per area: a pressure stands for the force.  The slip rate that
c     the model sees must be the mean over a period of the oscillation.  Below v_rest the stress
c     rises with the slip rate (mumacro_force): take v_rest well below the speeds that matter.
c     fric_coef.f gives the coefficient alone, from release 2020 on.
      subroutine fric(lm, tau, ddtddg, ddtddp, dslip, sed, sfd, ddtddt,
     &     pnewdt, statev, dgam, taulm, press, dpress, ddpddh, slip,
     &     kstep, kinc, time, dtime, noel, ciname, slname, msname, npt,
     &     node, npatch, coords, rcoord, drot, temp, predef, nfdir,
     &     mcrd, npred, nstatv, chrlngth, props, nprops)
      use mumacro, only: mumacro_evaluate_force
      include 'aba_param.inc'
      character*80 ciname, slname, msname
      dimension tau(nfdir), ddtddg(nfdir, nfdir), ddtddp(nfdir),
     &     dslip(nfdir), ddtddt(nfdir, 2), statev(*), dgam(nfdir),
     &     taulm(nfdir), slip(nfdir), time(2), coords(mcrd),
     &     rcoord(mcrd), drot(2, 2), temp(2), predef(2, *),
     &     props(nprops)
      dimension rate(nfdir), way(nfdir), by(6)

      lm = 0
      tau = 0
      ddtddg = 0
      ddtddp = 0
      if (press <= 0 .or. dtime <= 0) return
      rate = dgam/dtime
      v = sqrt(sum(rate**2))
      ierror = mumacro_evaluate_force(0, 0, v, 1d0*props(5),
     &     1d0*props(1), 1d0*press, 1d0*props(2), 1d0*props(3),
     &     1d0*props(4), stress, by)
c     at rest the stress is linear in the rate
      way = 0
      across = by(6)
      if (v > 0) then
         way = rate/v
         across = stress/v
      end if
      tau = stress*way
      do i = 1, nfdir
         ddtddg(i, i) = across/dtime
         do j = 1, nfdir
            ddtddg(i, j) = ddtddg(i, j) +
     &           (by(6) - across)*way(i)*way(j)/dtime
         end do
      end do
      ddtddp = by(2)*way
      dslip = dgam
      sfd = sum(tau*dgam)
      end subroutine fric
