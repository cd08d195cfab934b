% Write tests/files/isetcam_{linear,photons}.mat with Octave (7.3 was used): octave write_isetcam.m
% The variables are those of ISETCam's ieSaveMultiSpectralImage.m (linear model with mean) and of vcReadImage.m (photons).
mcCOEF = cat(3, [1 2 3; 4 5 6], [0 1 0; -1 0 2]);   % rows, columns, bases; photons of the pixel below 1, left are negative
basis.wave = (400:10:700)';
t = (basis.wave - 400) / 300;
basis.basis = [1e13 * (1 + t), 3e13 * sin(pi * t)];
imgMean = 2e12 * (1 - t);
illuminant.wavelength = basis.wave;
illuminant.data = 0.01 * ones(31, 1);
comment = 'a small scene';
fov = 10;
dist = 1.2;
name = 'isetcam_linear';
save('-v7', 'isetcam_linear.mat', 'mcCOEF', 'basis', 'imgMean', 'comment', 'illuminant', 'fov', 'dist', 'name');
wave = [450 550 650];
photons = single(1e14 * cat(3, [1 2 3; 4 5 6], [2 2 2; 2 2 2], [6 5 4; 3 2 1]));
save('-v7', 'isetcam_photons.mat', 'photons', 'wave', 'comment', 'illuminant');
