c     Abaqus/Explicit, contact pairs: the friction force of a contact that is oscillated
c     transversely. Link with mumacro.f90, mumacro.c and mumacro_table.c.
c
c     *Friction, user, properties=4
c     mu0 [-], k [N/m^3], y0 [m], omega [rad/s]
c
c     k is the tangential stiffness per area: the force and the area of a node give its pressure.
c     The slip rate that the model sees must be the mean over a period of the oscillation.  The
c     force is never above what makes the node stick.
      subroutine vfric(fTangential, statev, kStep, kInc, nContact,
     &     nFacNod, nSecNod, nMainNod, nFricDir, nDir, nStateVar,
     &     nProps, nTemp, nPred, numDefTfv, jSecUid, jMainUid,
     &     jConSecid, jConMainid, timStep, timGlb, dTimPrev, surfInt,
     &     surfSec, surfMain, lContType, dSlipFric, fStickForce,
     &     fTangPrev, fNormal, frictionWork, shape, coordSec, coordMain,
     &     dirCosS1, dirCosN, props, areaSec, tempSec, preDefSec,
     &     tempMain, preDefMain)
      use mumacro, only: mumacro_mu_macro
      include 'vaba_param.inc'
      character*80 surfInt, surfSec, surfMain
      dimension props(nProps), statev(nStateVar, nSecNod),
     &     dSlipFric(nDir, nContact), fTangential(nFricDir, nContact),
     &     fTangPrev(nDir, nContact), fStickForce(nContact),
     &     areaSec(nSecNod), fNormal(nContact), shape(nFacNod, nContact),
     &     coordSec(nDir, nSecNod), coordMain(nDir, nMainNod),
     &     dirCosS1(nDir, nContact), dirCosN(nDir, nContact),
     &     jSecUid(nSecNod), jMainUid(nMainNod), jConSecid(nContact),
     &     jConMainid(nFacNod, nContact), tempSec(nContact),
     &     preDefSec(nContact, nPred), tempMain(numDefTfv),
     &     preDefMain(numDefTfv, nPred)

c     the local 1-direction is that of the slip
      fTangential = 0
      do n = 1, nContact
         area = areaSec(jConSecid(n))
         if (fNormal(n) <= 0 .or. area <= 0) cycle
         rate = abs(dSlipFric(1, n))/timStep
         coefficient = mumacro_mu_macro(1d0*props(1), 1d0*fNormal(n),
     &        1d0*props(2)*area, 1d0*props(3), 1d0*props(4), 1d0*rate)
         fTangential(1, n) = -min(coefficient*fNormal(n),
     &        fStickForce(n))
      end do
      end subroutine vfric
