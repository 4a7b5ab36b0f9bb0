! Abaqus UMAT: von Mises, linear elastic and perfectly plastic, by radial return with its consistent tangent.
! PROPS: Young's modulus, Poisson's ratio, yield stress. STATEV: accumulated plastic strain.
! Above an equivalent stress of a million times the yield stress it asks for a smaller step by PNEWDT.
subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, &
                temp, dtemp, predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, &
                celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, jstep, kinc)
  implicit none
  integer, parameter :: dp = kind(1d0)
  character(len=80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, jstep(4), kinc
  real(dp) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens)
  real(dp) :: drpldt, stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops)
  real(dp) :: coords(3), drot(3, 3), pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3)
  real(dp) :: shear, lambda, bulk, mean, dev(ntens), equivalent, ratio, factor
  integer :: i, j

  shear = props(1) / (2 * (1 + props(2)))
  bulk = props(1) / (3 * (1 - 2 * props(2)))
  lambda = bulk - 2 * shear / 3
  do i = 1, ndi
    stress(i) = stress(i) + lambda * sum(dstran(1:ndi)) + 2 * shear * dstran(i)
  end do
  do i = ndi + 1, ntens
    stress(i) = stress(i) + shear * dstran(i)
  end do

  mean = sum(stress(1:ndi)) / 3
  dev = stress
  dev(1:ndi) = dev(1:ndi) - mean
  equivalent = sqrt(1.5_dp * (sum(dev(1:ndi)**2) + 2 * sum(dev(ndi + 1:ntens)**2)))
  if (equivalent > 1d6 * props(3)) pnewdt = 0.5_dp
  ratio = 1
  factor = 0
  if (equivalent > props(3)) then
    ratio = props(3) / equivalent
    factor = 3 * shear * ratio / equivalent**2
    statev(1) = statev(1) + (equivalent - props(3)) / (3 * shear)
    stress = ratio * dev
    stress(1:ndi) = stress(1:ndi) + mean
  end if

  do j = 1, ntens
    do i = 1, ntens
      ddsdde(i, j) = -factor * dev(i) * dev(j)
      if (i <= ndi .and. j <= ndi) ddsdde(i, j) = ddsdde(i, j) + bulk - 2 * ratio * shear / 3
      if (i == j) ddsdde(i, j) = ddsdde(i, j) + merge(2 * ratio * shear, ratio * shear, i <= ndi)
    end do
  end do
end subroutine
