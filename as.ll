define range(i32 -1, -2) i32 @_ZN10fem_models5chain9equations8assembleB3v17B44c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAK4JIagIAE5ArrayIdLi1E1C7mutable7alignedE535Parameters_28UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20bool_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20bool_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_29396Memory_28array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2991Load_28float64_2c_20UniTuple_28float64_20x_202_29_2c_20float64_2c_20float64_2c_20float64_29394Work_28array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_29db(ptr noalias writeonly captures(none) %retptr, ptr noalias writeonly captures(none) %excinfo, ptr %arg.x.0, ptr readnone captures(none) %arg.x.1, i64 %arg.x.2, i64 %arg.x.3, ptr readonly captures(none) %arg.x.4, i64 %arg.x.5.0, i64 %arg.x.6.0, double %arg.rig.0.0, double %arg.rig.0.1, double %arg.rig.1.0, double %arg.rig.1.1, double %arg.rig.2.0, double %arg.rig.2.1, double %arg.rig.3.0, double %arg.rig.3.1, double %arg.rig.4.0, double %arg.rig.4.1, double %arg.rig.5.0, double %arg.rig.5.1, double %arg.rig.6.0, double %arg.rig.6.1, i8 %arg.rig.7, double %arg.rig.8, double %arg.rig.9, double %arg.rig.10, double %arg.rig.11, double %arg.rig.12, double %arg.rig.13, double %arg.rig.14, double %arg.rig.15, double %arg.rig.16, double %arg.rig.17, double %arg.rig.18, double %arg.rig.19, i8 %arg.rig.20, double %arg.rig.21, double %arg.rig.22, double %arg.rig.23, double %arg.rig.24, double %arg.rig.25, double %arg.rig.26, double %arg.rig.27, double %arg.rig.28, ptr %arg.memory.0.0, ptr readnone captures(none) %arg.memory.0.1, i64 %arg.memory.0.2, i64 %arg.memory.0.3, ptr readonly captures(none) %arg.memory.0.4, i64 %arg.memory.0.5.0, i64 %arg.memory.0.5.1, i64 %arg.memory.0.6.0, i64 %arg.memory.0.6.1, ptr %arg.memory.1.0, ptr readnone captures(none) %arg.memory.1.1, i64 %arg.memory.1.2, i64 %arg.memory.1.3, ptr readonly captures(none) %arg.memory.1.4, i64 %arg.memory.1.5.0, i64 %arg.memory.1.5.1, i64 %arg.memory.1.6.0, i64 %arg.memory.1.6.1, ptr %arg.memory.2.0, ptr readnone captures(none) %arg.memory.2.1, i64 %arg.memory.2.2, i64 %arg.memory.2.3, ptr readonly captures(none) %arg.memory.2.4, i64 %arg.memory.2.5.0, i64 %arg.memory.2.6.0, ptr %arg.memory.3.0, ptr readnone captures(none) %arg.memory.3.1, i64 %arg.memory.3.2, i64 %arg.memory.3.3, ptr readonly captures(none) %arg.memory.3.4, i64 %arg.memory.3.5.0, i64 %arg.memory.3.6.0, ptr %arg.memory.4.0, ptr readnone captures(none) %arg.memory.4.1, i64 %arg.memory.4.2, i64 %arg.memory.4.3, ptr readonly captures(none) %arg.memory.4.4, i64 %arg.memory.4.5.0, i64 %arg.memory.4.5.1, i64 %arg.memory.4.6.0, i64 %arg.memory.4.6.1, ptr %arg.memory.5.0, ptr readnone captures(none) %arg.memory.5.1, i64 %arg.memory.5.2, i64 %arg.memory.5.3, ptr readonly captures(none) %arg.memory.5.4, i64 %arg.memory.5.5.0, i64 %arg.memory.5.6.0, ptr %arg.memory.6.0, ptr readnone captures(none) %arg.memory.6.1, i64 %arg.memory.6.2, i64 %arg.memory.6.3, ptr readonly captures(none) %arg.memory.6.4, i64 %arg.memory.6.5.0, i64 %arg.memory.6.6.0, ptr %arg.memory.7.0, ptr readnone captures(none) %arg.memory.7.1, i64 %arg.memory.7.2, i64 %arg.memory.7.3, ptr readonly captures(none) %arg.memory.7.4, i64 %arg.memory.7.5.0, i64 %arg.memory.7.6.0, ptr %arg.memory.8.0, ptr readnone captures(none) %arg.memory.8.1, i64 %arg.memory.8.2, i64 %arg.memory.8.3, ptr readonly captures(none) %arg.memory.8.4, i64 %arg.memory.8.5.0, i64 %arg.memory.8.6.0, ptr %arg.memory.9.0, ptr readnone captures(none) %arg.memory.9.1, i64 %arg.memory.9.2, i64 %arg.memory.9.3, ptr readonly captures(none) %arg.memory.9.4, i64 %arg.memory.9.5.0, i64 %arg.memory.9.6.0, double %arg.load.0, double %arg.load.1.0, double %arg.load.1.1, double %arg.load.2, double %arg.load.3, double %arg.load.4, ptr %arg.work.0.0, ptr readnone captures(none) %arg.work.0.1, i64 %arg.work.0.2, i64 %arg.work.0.3, ptr captures(none) %arg.work.0.4, i64 %arg.work.0.5.0, i64 %arg.work.0.5.1, i64 %arg.work.0.6.0, i64 %arg.work.0.6.1, ptr %arg.work.1.0, ptr readnone captures(none) %arg.work.1.1, i64 %arg.work.1.2, i64 %arg.work.1.3, ptr captures(none) initializes((0, 8)) %arg.work.1.4, i64 %arg.work.1.5.0, i64 %arg.work.1.6.0, ptr %arg.work.2.0, ptr readnone captures(none) %arg.work.2.1, i64 %arg.work.2.2, i64 %arg.work.2.3, ptr writeonly captures(none) %arg.work.2.4, i64 %arg.work.2.5.0, i64 %arg.work.2.6.0, ptr %arg.work.3.0, ptr readnone captures(none) %arg.work.3.1, i64 %arg.work.3.2, i64 %arg.work.3.3, ptr captures(none) %arg.work.3.4, i64 %arg.work.3.5.0, i64 %arg.work.3.6.0, ptr %arg.work.4.0, ptr readnone captures(none) %arg.work.4.1, i64 %arg.work.4.2, i64 %arg.work.4.3, ptr captures(none) %arg.work.4.4, i64 %arg.work.4.5.0, i64 %arg.work.4.6.0, ptr %arg.work.5.0, ptr readnone captures(none) %arg.work.5.1, i64 %arg.work.5.2, i64 %arg.work.5.3, ptr writeonly captures(none) %arg.work.5.4, i64 %arg.work.5.5.0, i64 %arg.work.5.5.1, i64 %arg.work.5.6.0, i64 %arg.work.5.6.1, ptr %arg.work.6.0, ptr readnone captures(none) %arg.work.6.1, i64 %arg.work.6.2, i64 %arg.work.6.3, ptr writeonly captures(none) %arg.work.6.4, i64 %arg.work.6.5.0, i64 %arg.work.6.5.1, i64 %arg.work.6.6.0, i64 %arg.work.6.6.1, ptr %arg.work.7.0, ptr readnone captures(none) %arg.work.7.1, i64 %arg.work.7.2, i64 %arg.work.7.3, ptr captures(none) %arg.work.7.4, i64 %arg.work.7.5.0, i64 %arg.work.7.5.1, i64 %arg.work.7.6.0, i64 %arg.work.7.6.1, ptr %arg.work.8.0, ptr readnone captures(none) %arg.work.8.1, i64 %arg.work.8.2, i64 %arg.work.8.3, ptr readonly captures(none) %arg.work.8.4, i64 %arg.work.8.5.0, i64 %arg.work.8.6.0, ptr %arg.work.9.0, ptr readnone captures(none) %arg.work.9.1, i64 %arg.work.9.2, i64 %arg.work.9.3, ptr readonly captures(none) %arg.work.9.4, i64 %arg.work.9.5.0, i64 %arg.work.9.6.0, double %arg.rate, i8 %arg.settle) local_unnamed_addr {
entry:
  %.1008 = alloca double, align 8
  store double 0.000000e+00, ptr %.1008, align 8
  %excinfo.2 = alloca ptr, align 8
  store ptr null, ptr %excinfo.2, align 8
  %.3036 = alloca ptr, align 8
  store ptr null, ptr %.3036, align 8
  %excinfo.18 = alloca ptr, align 8
  store ptr null, ptr %excinfo.18, align 8
  tail call void @NRT_incref(ptr %arg.x.0)
  tail call void @NRT_incref(ptr %arg.memory.0.0)
  tail call void @NRT_incref(ptr %arg.memory.1.0)
  tail call void @NRT_incref(ptr %arg.memory.2.0)
  tail call void @NRT_incref(ptr %arg.memory.3.0)
  tail call void @NRT_incref(ptr %arg.memory.4.0)
  tail call void @NRT_incref(ptr %arg.memory.5.0)
  tail call void @NRT_incref(ptr %arg.memory.6.0)
  tail call void @NRT_incref(ptr %arg.memory.7.0)
  tail call void @NRT_incref(ptr %arg.memory.8.0)
  tail call void @NRT_incref(ptr %arg.memory.9.0)
  tail call void @NRT_incref(ptr %arg.work.0.0)
  tail call void @NRT_incref(ptr %arg.work.1.0)
  tail call void @NRT_incref(ptr %arg.work.2.0)
  tail call void @NRT_incref(ptr %arg.work.3.0)
  tail call void @NRT_incref(ptr %arg.work.4.0)
  tail call void @NRT_incref(ptr %arg.work.5.0)
  tail call void @NRT_incref(ptr %arg.work.6.0)
  tail call void @NRT_incref(ptr %arg.work.7.0)
  tail call void @NRT_incref(ptr %arg.work.8.0)
  tail call void @NRT_incref(ptr %arg.work.9.0)
  tail call void @NRT_incref(ptr %arg.work.0.0)
  tail call void @NRT_incref(ptr %arg.work.1.0)
  %.697 = icmp sgt i64 %arg.work.0.5.0, 0
  %.812.not2007 = icmp sgt i64 %arg.work.0.5.1, 0
  %or.cond2242 = select i1 %.697, i1 %.812.not2007, i1 false, !prof !0
  br i1 %or.cond2242, label %.775.preheader.us.preheader, label %B168, !prof !0

B168:                                             ; preds = %.775.preheader.us.preheader, %entry
  %0 = icmp ne i8 %arg.rig.20, 0
  %1 = icmp ne i8 %arg.rig.7, 0
  %.836 = mul nsw i64 %arg.memory.0.5.1, 3
  %.837 = add nsw i64 %.836, 1
  %.840 = add nsw i64 %.836, 2
  %2 = getelementptr i8, ptr %arg.work.0.4, i64 40
  %.77.i = load double, ptr %2, align 8, !noalias !1
  %.78.i = fadd double %.77.i, 1.000000e+00
  store double %.78.i, ptr %2, align 8, !noalias !1
  store double 0.000000e+00, ptr %arg.work.1.4, align 8
  %.50.i = icmp slt i64 %arg.memory.0.5.1, 0
  %.51.i = select i1 %.50.i, i64 %arg.work.0.5.0, i64 0
  %.52.i = add i64 %.51.i, %.837
  %.72.i = mul i64 %.52.i, %arg.work.0.5.1
  %3 = getelementptr double, ptr %arg.work.0.4, i64 %.72.i
  %4 = getelementptr i8, ptr %3, i64 40
  %.77.i1 = load double, ptr %4, align 8, !noalias !4
  %.78.i2 = fadd double %.77.i1, 1.000000e+00
  store double %.78.i2, ptr %4, align 8, !noalias !4
  %.980.1 = select i1 %.50.i, i64 %arg.work.1.5.0, i64 0
  %5 = getelementptr double, ptr %arg.work.1.4, i64 %.837
  %.994.1 = getelementptr double, ptr %5, i64 %.980.1
  store double 0.000000e+00, ptr %.994.1, align 8
  %.52.i5 = add i64 %.51.i, %.840
  %.72.i6 = mul i64 %.52.i5, %arg.work.0.5.1
  %6 = getelementptr double, ptr %arg.work.0.4, i64 %.72.i6
  %7 = getelementptr i8, ptr %6, i64 40
  %.77.i7 = load double, ptr %7, align 8, !noalias !7
  %.78.i8 = fadd double %.77.i7, 1.000000e+00
  store double %.78.i8, ptr %7, align 8, !noalias !7
  %8 = getelementptr double, ptr %arg.work.1.4, i64 %.840
  %.994.2 = getelementptr double, ptr %8, i64 %.980.1
  store double 0.000000e+00, ptr %.994.2, align 8
  store double 0.000000e+00, ptr %.1008, align 8
  %.1028 = zext i1 %1 to i8
  %.1029 = zext i1 %0 to i8
  %.1058 = call i32 @_ZN10fem_models5chain9equations16external_momentsB3v19B44c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAK4JIagIAE5ArrayIdLi1E1C7mutable7alignedE535Parameters_28UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20UniTuple_28float64_20x_202_29_2c_20bool_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20bool_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_2c_20float64_29394Work_28array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_29(ptr nonnull %.1008, ptr nonnull %excinfo.2, ptr %arg.x.0, ptr %arg.x.1, i64 %arg.x.2, i64 %arg.x.3, ptr %arg.x.4, i64 %arg.x.5.0, i64 %arg.x.6.0, double %arg.rig.0.0, double %arg.rig.0.1, double %arg.rig.1.0, double %arg.rig.1.1, double %arg.rig.2.0, double %arg.rig.2.1, double %arg.rig.3.0, double %arg.rig.3.1, double %arg.rig.4.0, double %arg.rig.4.1, double %arg.rig.5.0, double %arg.rig.5.1, double %arg.rig.6.0, double %arg.rig.6.1, i8 %.1028, double %arg.rig.8, double %arg.rig.9, double %arg.rig.10, double %arg.rig.11, double %arg.rig.12, double %arg.rig.13, double %arg.rig.14, double %arg.rig.15, double %arg.rig.16, double %arg.rig.17, double %arg.rig.18, double %arg.rig.19, i8 %.1029, double %arg.rig.21, double %arg.rig.22, double %arg.rig.23, double %arg.rig.24, double %arg.rig.25, double %arg.rig.26, double %arg.rig.27, double %arg.rig.28, ptr %arg.work.0.0, ptr %arg.work.0.1, i64 %arg.work.0.2, i64 %arg.work.0.3, ptr %arg.work.0.4, i64 %arg.work.0.5.0, i64 %arg.work.0.5.1, i64 %arg.work.0.6.0, i64 %arg.work.0.6.1, ptr %arg.work.1.0, ptr %arg.work.1.1, i64 %arg.work.1.2, i64 %arg.work.1.3, ptr nonnull %arg.work.1.4, i64 %arg.work.1.5.0, i64 %arg.work.1.6.0, ptr %arg.work.2.0, ptr %arg.work.2.1, i64 %arg.work.2.2, i64 %arg.work.2.3, ptr %arg.work.2.4, i64 %arg.work.2.5.0, i64 %arg.work.2.6.0, ptr %arg.work.3.0, ptr %arg.work.3.1, i64 %arg.work.3.2, i64 %arg.work.3.3, ptr %arg.work.3.4, i64 %arg.work.3.5.0, i64 %arg.work.3.6.0, ptr %arg.work.4.0, ptr %arg.work.4.1, i64 %arg.work.4.2, i64 %arg.work.4.3, ptr %arg.work.4.4, i64 %arg.work.4.5.0, i64 %arg.work.4.6.0, ptr %arg.work.5.0, ptr %arg.work.5.1, i64 %arg.work.5.2, i64 %arg.work.5.3, ptr %arg.work.5.4, i64 %arg.work.5.5.0, i64 %arg.work.5.5.1, i64 %arg.work.5.6.0, i64 %arg.work.5.6.1, ptr %arg.work.6.0, ptr %arg.work.6.1, i64 %arg.work.6.2, i64 %arg.work.6.3, ptr %arg.work.6.4, i64 %arg.work.6.5.0, i64 %arg.work.6.5.1, i64 %arg.work.6.6.0, i64 %arg.work.6.6.1, ptr %arg.work.7.0, ptr %arg.work.7.1, i64 %arg.work.7.2, i64 %arg.work.7.3, ptr %arg.work.7.4, i64 %arg.work.7.5.0, i64 %arg.work.7.5.1, i64 %arg.work.7.6.0, i64 %arg.work.7.6.1, ptr %arg.work.8.0, ptr %arg.work.8.1, i64 %arg.work.8.2, i64 %arg.work.8.3, ptr %arg.work.8.4, i64 %arg.work.8.5.0, i64 %arg.work.8.6.0, ptr %arg.work.9.0, ptr %arg.work.9.1, i64 %arg.work.9.2, i64 %arg.work.9.3, ptr %arg.work.9.4, i64 %arg.work.9.5.0, i64 %arg.work.9.6.0)
  %.1068 = load double, ptr %.1008, align 8
  %cond = icmp eq i32 %.1058, 0
  br i1 %cond, label %B168.endif, label %B168.if.if, !prof !10

B1614:                                            ; preds = %B380.endif.endif.endif.en...endif.1.endif, %B168.endif.endif.endif.endif
  %largest.3.0.lcssa = phi double [ 0.000000e+00, %B168.endif.endif.endif.endif ], [ %.19.i, %B380.endif.endif.endif.en...endif.1.endif ]
  tail call void @NRT_decref(ptr %arg.x.0)
  tail call void @NRT_decref(ptr %arg.memory.0.0)
  tail call void @NRT_decref(ptr %arg.memory.1.0)
  tail call void @NRT_decref(ptr %arg.memory.2.0)
  tail call void @NRT_decref(ptr %arg.memory.3.0)
  tail call void @NRT_decref(ptr %arg.memory.4.0)
  tail call void @NRT_decref(ptr %arg.memory.5.0)
  tail call void @NRT_decref(ptr %arg.memory.6.0)
  tail call void @NRT_decref(ptr %arg.memory.7.0)
  tail call void @NRT_decref(ptr %arg.memory.8.0)
  tail call void @NRT_decref(ptr %arg.memory.9.0)
  tail call void @NRT_decref(ptr %arg.work.0.0)
  tail call void @NRT_decref(ptr %arg.work.1.0)
  %.2977 = fcmp ogt double %.1068, 0.000000e+00
  %.2984 = fcmp une double %arg.rig.21, 0.000000e+00
  %or.cond = select i1 %.2977, i1 true, i1 %.2984
  %.3006 = fcmp une double %arg.rig.22, 0.000000e+00
  %spec.select = select i1 %or.cond, i1 true, i1 %.3006
  br i1 %spec.select, label %B1674, label %B1704

B1674:                                            ; preds = %B1614
  %.3068 = call i32 @_ZN10fem_models5chain9equations11by_headingsB3v41B44c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAK4JIagIAE394Work_28array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_202d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_2c_20array_28float64_2c_201d_2c_20C_29_29(ptr nonnull %.3036, ptr nonnull %excinfo.18, ptr %arg.work.0.0, ptr %arg.work.0.1, i64 %arg.work.0.2, i64 %arg.work.0.3, ptr nonnull %arg.work.0.4, i64 %arg.work.0.5.0, i64 %arg.work.0.5.1, i64 %arg.work.0.6.0, i64 %arg.work.0.6.1, ptr %arg.work.1.0, ptr %arg.work.1.1, i64 %arg.work.1.2, i64 %arg.work.1.3, ptr nonnull %arg.work.1.4, i64 %arg.work.1.5.0, i64 %arg.work.1.6.0, ptr %arg.work.2.0, ptr %arg.work.2.1, i64 %arg.work.2.2, i64 %arg.work.2.3, ptr %arg.work.2.4, i64 %arg.work.2.5.0, i64 %arg.work.2.6.0, ptr %arg.work.3.0, ptr %arg.work.3.1, i64 %arg.work.3.2, i64 %arg.work.3.3, ptr %arg.work.3.4, i64 %arg.work.3.5.0, i64 %arg.work.3.6.0, ptr %arg.work.4.0, ptr %arg.work.4.1, i64 %arg.work.4.2, i64 %arg.work.4.3, ptr %arg.work.4.4, i64 %arg.work.4.5.0, i64 %arg.work.4.6.0, ptr %arg.work.5.0, ptr %arg.work.5.1, i64 %arg.work.5.2, i64 %arg.work.5.3, ptr nonnull %arg.work.5.4, i64 %arg.work.5.5.0, i64 %arg.work.5.5.1, i64 %arg.work.5.6.0, i64 %arg.work.5.6.1, ptr %arg.work.6.0, ptr %arg.work.6.1, i64 %arg.work.6.2, i64 %arg.work.6.3, ptr %arg.work.6.4, i64 %arg.work.6.5.0, i64 %arg.work.6.5.1, i64 %arg.work.6.6.0, i64 %arg.work.6.6.1, ptr %arg.work.7.0, ptr %arg.work.7.1, i64 %arg.work.7.2, i64 %arg.work.7.3, ptr %arg.work.7.4, i64 %arg.work.7.5.0, i64 %arg.work.7.5.1, i64 %arg.work.7.6.0, i64 %arg.work.7.6.1, ptr %arg.work.8.0, ptr %arg.work.8.1, i64 %arg.work.8.2, i64 %arg.work.8.3, ptr %arg.work.8.4, i64 %arg.work.8.5.0, i64 %arg.work.8.6.0, ptr %arg.work.9.0, ptr %arg.work.9.1, i64 %arg.work.9.2, i64 %arg.work.9.3, ptr %arg.work.9.4, i64 %arg.work.9.5.0, i64 %arg.work.9.6.0)
  %cond281 = icmp eq i32 %.3068, 0
  br i1 %cond281, label %B1674.endif, label %B1674.if.if, !prof !10

common.ret:                                       ; preds = %B1674.if.if, %B168.if.if, %B1704
  %common.ret.op = phi i32 [ 0, %B1704 ], [ %.3068, %B1674.if.if ], [ %.1058, %B168.if.if ]
  ret i32 %common.ret.op

B1704:                                            ; preds = %B1674.endif, %B1614
  %work.sroa.1349.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.9.0, %B1614 ]
  %work.sroa.1216.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.8.0, %B1614 ]
  %work.sroa.1045.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.7.0, %B1614 ]
  %work.sroa.874.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.6.0, %B1614 ]
  %work.sroa.703.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.5.0, %B1614 ]
  %work.sroa.570.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.4.0, %B1614 ]
  %work.sroa.437.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.3.0, %B1614 ]
  %work.sroa.304.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.2.0, %B1614 ]
  %work.sroa.171.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.1.0, %B1614 ]
  %work.sroa.0.0 = phi ptr [ null, %B1674.endif ], [ %arg.work.0.0, %B1614 ]
  tail call void @NRT_decref(ptr %work.sroa.0.0)
  tail call void @NRT_decref(ptr %work.sroa.171.0)
  tail call void @NRT_decref(ptr %work.sroa.304.0)
  tail call void @NRT_decref(ptr %work.sroa.437.0)
  tail call void @NRT_decref(ptr %work.sroa.570.0)
  tail call void @NRT_decref(ptr %work.sroa.703.0)
  tail call void @NRT_decref(ptr %work.sroa.874.0)
  tail call void @NRT_decref(ptr %work.sroa.1045.0)
  tail call void @NRT_decref(ptr %work.sroa.1216.0)
  tail call void @NRT_decref(ptr %work.sroa.1349.0)
  %.3181 = zext i1 %spec.select to i8
  %.3182 = insertvalue { double, double, i8 } undef, double %largest.3.0.lcssa, 0
  %.3183 = insertvalue { double, double, i8 } %.3182, double %.1068, 1
  %.3184 = insertvalue { double, double, i8 } %.3183, i8 %.3181, 2
  store { double, double, i8 } %.3184, ptr %retptr, align 8
  br label %common.ret

.775.preheader.us.preheader:                      ; preds = %entry
  %9 = shl i64 %arg.work.0.5.0, 3
  %10 = mul i64 %9, %arg.work.0.5.1
  tail call void @llvm.memset.p0.i64(ptr align 8 %arg.work.0.4, i8 0, i64 %10, i1 false)
  br label %B168

B168.endif:                                       ; preds = %B168
  %11 = icmp ne i8 %arg.rig.7, 0
  br i1 %11, label %B168.endif.endif.endif.endif, label %B70.i

B70.i:                                            ; preds = %B168.endif
  %.419.i = getelementptr i8, ptr %arg.x.4, i64 8
  %.420.i = load double, ptr %.419.i, align 8, !noalias !11
  %.421.i = fsub double %arg.load.0, %.420.i
  %.429.i = fsub double %.421.i, %arg.load.1.0
  %.212.i.i = fcmp oeq double %arg.rig.4.0, 0.000000e+00
  br i1 %.212.i.i, label %B94.i.i, label %B134.endif.endif.endif.i.i

B94.i.i:                                          ; preds = %B70.i
  %.220.i.i = fmul double %arg.rig.3.0, %.429.i
  %.224.i.i = fadd double %arg.rig.0.0, %.220.i.i
  %.231.i.i = fcmp ogt double %.224.i.i, 0.000000e+00
  %"$phi132.0.2.sroa.8.0.i.i" = select i1 %.231.i.i, double %arg.rig.3.0, double 0.000000e+00
  %"$phi132.0.2.sroa.0.0.i.i" = select i1 %.231.i.i, double %.224.i.i, double 0.000000e+00
  br label %B70.endif.i

B522.i.i:                                         ; preds = %B298.endif.endif.endif.i.i
  %.571.i.i = tail call double @llvm.exp.f64(double %.533.i.i)
  %.575.i.i = fmul double %arg.rig.3.0, %.571.i.i
  %.579.i.i = fadd double %arg.rig.4.0, %.571.i.i
  %.585.i.i = fdiv double %.575.i.i, %.579.i.i
  br label %B70.endif.i

B134.endif.endif.endif.i.i:                       ; preds = %B70.i
  %.463.i = load double, ptr %arg.work.9.4, align 8, !noalias !11
  %.288.i.i = tail call double @llvm.log.f64(double %arg.rig.0.0)
  %.290.i.i = fmul double %.288.i.i, %arg.rig.4.0
  %.292.i.i = fadd double %arg.rig.0.0, %.290.i.i
  %.297.i.i = fmul double %arg.rig.3.0, %.429.i
  %.300.i.i = fadd double %.292.i.i, %.297.i.i
  %.12.i.i.i = fcmp olt double %.463.i, 1.000000e-300
  %.13.i.i.i = select i1 %.12.i.i.i, double 1.000000e-300, double %.463.i
  %.335.i.i = tail call double @llvm.log.f64(double %.13.i.i.i)
  br label %B298.endif.endif.endif.i.i

B298.endif.endif.endif.i.i:                       ; preds = %B298.endif.endif.endif.i.i, %B134.endif.endif.endif.i.i
  %y.2.064.i.i = phi double [ %.335.i.i, %B134.endif.endif.endif.i.i ], [ %.533.i.i, %B298.endif.endif.endif.i.i ]
  %.42163.i.i = phi i64 [ 100, %B134.endif.endif.endif.i.i ], [ %.431.i.i, %B298.endif.endif.endif.i.i ]
  %.431.i.i = add nsw i64 %.42163.i.i, -1
  %.12.i3.i.i = fcmp ogt double %y.2.064.i.i, 7.000000e+02
  %.13.i4.i.i = select i1 %.12.i3.i.i, double 7.000000e+02, double %y.2.064.i.i
  %.491.i.i = tail call double @llvm.exp.f64(double %.13.i4.i.i)
  %.494.i.i = fmul double %arg.rig.4.0, %y.2.064.i.i
  %.495.i.i = fadd double %.494.i.i, %.491.i.i
  %.497.i.i = fsub double %.495.i.i, %.300.i.i
  %.499.i.i = fadd double %arg.rig.4.0, %.491.i.i
  %.503.i.i = fdiv double %.497.i.i, %.499.i.i
  %.12.i1.i.i = fcmp olt double %.503.i.i, -2.000000e+00
  %.13.i2.i.i = select i1 %.12.i1.i.i, double -2.000000e+00, double %.503.i.i
  %.533.i.i = fsub double %y.2.064.i.i, %.13.i2.i.i
  %.539.i.i = tail call double @llvm.fabs.f64(double %.13.i2.i.i)
  %.541.i.i = tail call double @llvm.fabs.f64(double %.533.i.i)
  %.542.i.i = fadd double %.541.i.i, 1.000000e+00
  %.543.i.i = fmul double %.542.i.i, 1.000000e-15
  %.544.i.i = fcmp uge double %.539.i.i, %.543.i.i
  %.422.i.i = icmp samesign ugt i64 %.42163.i.i, 1
  %or.cond.i.i = select i1 %.544.i.i, i1 %.422.i.i, i1 false
  br i1 %or.cond.i.i, label %B298.endif.endif.endif.i.i, label %B522.i.i

B70.endif.i:                                      ; preds = %B522.i.i, %B94.i.i
  %.571.sink.i.i = phi double [ %.571.i.i, %B522.i.i ], [ %"$phi132.0.2.sroa.0.0.i.i", %B94.i.i ]
  %.585.sink.i.i = phi double [ %.585.i.i, %B522.i.i ], [ %"$phi132.0.2.sroa.8.0.i.i", %B94.i.i ]
  %.521.i = fneg double %arg.load.0
  %.550.i = getelementptr i8, ptr %arg.x.4, i64 16
  %.551.i = load double, ptr %.550.i, align 8, !noalias !11
  %.557.i = fsub double %.521.i, %.551.i
  %.569.i = fsub double %.557.i, %arg.load.1.1
  %.212.i1.i = fcmp oeq double %arg.rig.4.1, 0.000000e+00
  br i1 %.212.i1.i, label %B94.i41.i, label %B134.endif.endif.endif.i2.i

B94.i41.i:                                        ; preds = %B70.endif.i
  %.220.i42.i = fmul double %arg.rig.3.1, %.569.i
  %.224.i43.i = fadd double %arg.rig.0.1, %.220.i42.i
  %.231.i44.i = fcmp ogt double %.224.i43.i, 0.000000e+00
  %"$phi132.0.2.sroa.8.0.i45.i" = select i1 %.231.i44.i, double %arg.rig.3.1, double 0.000000e+00
  %"$phi132.0.2.sroa.0.0.i46.i" = select i1 %.231.i44.i, double %.224.i43.i, double 0.000000e+00
  br label %B168.endif.endif.endif.endif

B522.i33.i:                                       ; preds = %B298.endif.endif.endif.i11.i
  %.571.i34.i = tail call double @llvm.exp.f64(double %.533.i25.i)
  %.575.i35.i = fmul double %arg.rig.3.1, %.571.i34.i
  %.579.i36.i = fadd double %arg.rig.4.1, %.571.i34.i
  %.585.i37.i = fdiv double %.575.i35.i, %.579.i36.i
  br label %B168.endif.endif.endif.endif

B134.endif.endif.endif.i2.i:                      ; preds = %B70.endif.i
  %.642.i = getelementptr i8, ptr %arg.work.9.4, i64 8
  %.643.i = load double, ptr %.642.i, align 8, !noalias !11
  %.288.i3.i = tail call double @llvm.log.f64(double %arg.rig.0.1)
  %.290.i4.i = fmul double %.288.i3.i, %arg.rig.4.1
  %.292.i5.i = fadd double %arg.rig.0.1, %.290.i4.i
  %.297.i6.i = fmul double %arg.rig.3.1, %.569.i
  %.300.i7.i = fadd double %.292.i5.i, %.297.i6.i
  %.12.i.i8.i = fcmp olt double %.643.i, 1.000000e-300
  %.13.i.i9.i = select i1 %.12.i.i8.i, double 1.000000e-300, double %.643.i
  %.335.i10.i = tail call double @llvm.log.f64(double %.13.i.i9.i)
  br label %B298.endif.endif.endif.i11.i

B298.endif.endif.endif.i11.i:                     ; preds = %B298.endif.endif.endif.i11.i, %B134.endif.endif.endif.i2.i
  %y.2.064.i12.i = phi double [ %.335.i10.i, %B134.endif.endif.endif.i2.i ], [ %.533.i25.i, %B298.endif.endif.endif.i11.i ]
  %.42163.i13.i = phi i64 [ 100, %B134.endif.endif.endif.i2.i ], [ %.431.i14.i, %B298.endif.endif.endif.i11.i ]
  %.431.i14.i = add nsw i64 %.42163.i13.i, -1
  %.12.i3.i15.i = fcmp ogt double %y.2.064.i12.i, 7.000000e+02
  %.13.i4.i16.i = select i1 %.12.i3.i15.i, double 7.000000e+02, double %y.2.064.i12.i
  %.491.i17.i = tail call double @llvm.exp.f64(double %.13.i4.i16.i)
  %.494.i18.i = fmul double %arg.rig.4.1, %y.2.064.i12.i
  %.495.i19.i = fadd double %.494.i18.i, %.491.i17.i
  %.497.i20.i = fsub double %.495.i19.i, %.300.i7.i
  %.499.i21.i = fadd double %arg.rig.4.1, %.491.i17.i
  %.503.i22.i = fdiv double %.497.i20.i, %.499.i21.i
  %.12.i1.i23.i = fcmp olt double %.503.i22.i, -2.000000e+00
  %.13.i2.i24.i = select i1 %.12.i1.i23.i, double -2.000000e+00, double %.503.i22.i
  %.533.i25.i = fsub double %y.2.064.i12.i, %.13.i2.i24.i
  %.539.i26.i = tail call double @llvm.fabs.f64(double %.13.i2.i24.i)
  %.541.i27.i = tail call double @llvm.fabs.f64(double %.533.i25.i)
  %.542.i28.i = fadd double %.541.i27.i, 1.000000e+00
  %.543.i29.i = fmul double %.542.i28.i, 1.000000e-15
  %.544.i30.i = fcmp uge double %.539.i26.i, %.543.i29.i
  %.422.i31.i = icmp samesign ugt i64 %.42163.i13.i, 1
  %or.cond.i32.i = select i1 %.544.i30.i, i1 %.422.i31.i, i1 false
  br i1 %or.cond.i32.i, label %B298.endif.endif.endif.i11.i, label %B522.i33.i

B168.if.if:                                       ; preds = %B168
  store ptr null, ptr %excinfo, align 8
  br label %common.ret

B168.endif.endif.endif.endif:                     ; preds = %B94.i41.i, %B522.i33.i, %B168.endif
  %.1086.sroa.0.0 = phi double [ %arg.load.0, %B168.endif ], [ %.571.sink.i.i, %B522.i33.i ], [ %.571.sink.i.i, %B94.i41.i ]
  %.1086.sroa.5.0 = phi double [ 0.000000e+00, %B168.endif ], [ %.571.i34.i, %B522.i33.i ], [ %"$phi132.0.2.sroa.0.0.i46.i", %B94.i41.i ]
  %.1086.sroa.8.0 = phi double [ 0.000000e+00, %B168.endif ], [ %.585.sink.i.i, %B522.i33.i ], [ %.585.sink.i.i, %B94.i41.i ]
  %.1086.sroa.10.0 = phi double [ 0.000000e+00, %B168.endif ], [ %.585.i37.i, %B522.i33.i ], [ %"$phi132.0.2.sroa.8.0.i45.i", %B94.i41.i ]
  %.87.i39 = fmul double %arg.rig.8, 5.000000e-01
  %.88.i40 = tail call double @llvm.sin.f64(double %.87.i39)
  %.90.i41 = tail call double @llvm.cos.f64(double %.87.i39)
  %.118.i42 = fsub double 1.000000e+00, %.90.i41
  %.119.i43 = fmul double %.118.i42, %arg.rig.12
  %.120.i44 = fmul double %arg.rig.1.0, %.88.i40
  %.121.i45 = fadd double %.120.i44, %.119.i43
  %.122.i46 = fmul double %.121.i45, 2.000000e+00
  %.125.i47 = fmul double %arg.rig.1.1, %.88.i40
  %.126.i48 = fadd double %.125.i47, %.119.i43
  %.127.i49 = fmul double %.126.i48, 2.000000e+00
  store double %.1086.sroa.0.0, ptr %arg.work.5.4, align 8
  %.1406 = getelementptr double, ptr %arg.work.5.4, i64 %arg.work.5.5.1
  store double %.1086.sroa.5.0, ptr %.1406, align 8
  %.14992041.not = icmp slt i64 %arg.memory.0.5.1, 1
  br i1 %.14992041.not, label %B1614, label %B380.lr.ph

B380.lr.ph:                                       ; preds = %B168.endif.endif.endif.endif
  %const = bitcast i64 9223372036854775804 to i64
  %.2059 = fmul double %arg.rig.27, %arg.rate
  %.144.i65 = fadd double %arg.rig.0.0, %arg.rig.0.1
  %.146.i = fmul double %.144.i65, %arg.rig.13
  %.165.i = fadd double %arg.rig.2.0, %arg.rig.2.1
  %.167.i = fmul double %.165.i, %arg.rig.13
  %.168.i = fadd double %.167.i, 1.000000e+00
  %.174.i = fmul double %arg.rig.2.1, %arg.rig.13
  %.175.i = fadd double %.174.i, 1.000000e+00
  %.180.i = fmul double %arg.rig.2.0, %arg.rig.13
  %.195.i = fadd double %.180.i, 1.000000e+00
  %.181.i = fadd double %arg.rig.15, %arg.rig.16
  %.189.i = fmul double %arg.rig.26, %arg.rate
  %.252.i83 = fmul double %arg.rig.14, 5.000000e-01
  %.1772.i = fmul double %arg.rig.2.0, 1.000000e-09
  %.2258.i = fmul double %arg.rig.28, 2.000000e+00
  %12 = getelementptr double, ptr %arg.memory.0.4, i64 %arg.memory.0.5.1
  %13 = getelementptr double, ptr %arg.work.7.4, i64 %arg.work.7.5.1
  %14 = getelementptr double, ptr %arg.work.6.4, i64 %arg.work.6.5.1
  %.1746.i = fcmp ogt double %arg.rig.2.1, 0.000000e+00
  %"$phi1108.1.2.0.i" = select i1 %.1746.i, double %arg.rig.2.1, double %arg.rig.2.0
  %.1772.i227 = fmul double %"$phi1108.1.2.0.i", 1.000000e-09
  %.325.i = fmul double %arg.rig.2.0, 0x3EB0C6F7A0B5ED8D
  %.327.i = fmul double %arg.rig.2.1, 0x3EB0C6F7A0B5ED8D
  %.414.i = fdiv double %arg.rig.2.1, %.175.i
  %.372.i = fdiv double %arg.rig.2.0, %.195.i
  %.240.i = fneg double %arg.rig.2.0
  %.242.i = fmul double %arg.rig.2.1, %.240.i
  %.244.i = fmul double %.242.i, %arg.rig.13
  %.249.i = fdiv double %.244.i, %.168.i
  %.258.i = fmul double %arg.rig.2.0, %.175.i
  %.263.i = fdiv double %.258.i, %.168.i
  %.273.i = fmul double %arg.rig.2.1, %.195.i
  %.280.i = fdiv double %.273.i, %.168.i
  %xtraiter.i = and i64 %arg.memory.3.2, 3
  %unroll_iter.i = and i64 %arg.memory.3.2, %const
  %sunkaddr75.i = shl i64 %arg.memory.1.5.1, 3
  %const_mat = add i64 %const, 2
  %unroll_iter17.i = and i64 %arg.memory.5.2, %const_mat
  %15 = shl i64 %arg.memory.4.5.1, 4
  %.804.epil.i = mul i64 %unroll_iter17.i, %arg.memory.4.5.1
  br label %B380.endif

B380.endif:                                       ; preds = %B380.endif.endif.endif.en...endif.1.endif, %B380.lr.ph
  %largest.3.02051 = phi double [ 0.000000e+00, %B380.lr.ph ], [ %.19.i, %B380.endif.endif.endif.en...endif.1.endif ]
  %near.2.sroa.0.02050 = phi double [ %.1086.sroa.0.0, %B380.lr.ph ], [ %ta.4.0.i, %B380.endif.endif.endif.en...endif.1.endif ]
  %near.2.sroa.8.02049 = phi double [ %.1086.sroa.5.0, %B380.lr.ph ], [ %tb.4.0.i, %B380.endif.endif.endif.en...endif.1.endif ]
  %near.2.sroa.16.02048 = phi double [ %.1086.sroa.8.0, %B380.lr.ph ], [ %own_a.3.0.i, %B380.endif.endif.endif.en...endif.1.endif ]
  %near.2.sroa.24.02047 = phi double [ %.1086.sroa.10.0, %B380.lr.ph ], [ %own_b.3.0.i, %B380.endif.endif.endif.en...endif.1.endif ]
  %near.2.sroa.32.02046 = phi double [ 0.000000e+00, %B380.lr.ph ], [ %cross.2.0.i, %B380.endif.endif.endif.en...endif.1.endif ]
  %near.2.sroa.40.02045 = phi double [ 0.000000e+00, %B380.lr.ph ], [ %.457.i, %B380.endif.endif.endif.en...endif.1.endif ]
  %near.2.sroa.48.02044 = phi double [ 0.000000e+00, %B380.lr.ph ], [ %.471.i, %B380.endif.endif.endif.en...endif.1.endif ]
  %.150520282042 = phi i64 [ 0, %B380.lr.ph ], [ %.1512, %B380.endif.endif.endif.en...endif.1.endif ]
  %.1512 = add nuw nsw i64 %.150520282042, 1
  %.1537 = mul nuw nsw i64 %.150520282042, 3
  %.1540 = add nuw nsw i64 %.1537, 3
  %16 = getelementptr double, ptr %arg.x.4, i64 %.1540
  %.1570 = load double, ptr %16, align 8
  %.87.i = fmul double %.1570, 5.000000e-01
  %.88.i = tail call double @llvm.sin.f64(double %.87.i)
  %.90.i = tail call double @llvm.cos.f64(double %.87.i)
  %.118.i = fsub double 1.000000e+00, %.90.i
  %.119.i = fmul double %arg.rig.12, %.118.i
  %.120.i = fmul double %arg.rig.1.0, %.88.i
  %.121.i = fadd double %.120.i, %.119.i
  %.122.i = fmul double %.121.i, 2.000000e+00
  %.125.i = fmul double %arg.rig.1.1, %.88.i
  %.126.i = fadd double %.125.i, %.119.i
  %.127.i = fmul double %.126.i, 2.000000e+00
  %.132.i = fmul double %arg.rig.12, %.88.i
  %.133.i = fmul double %arg.rig.1.0, %.90.i
  %.134.i = fadd double %.133.i, %.132.i
  %.136.i = fmul double %arg.rig.1.1, %.90.i
  %.137.i = fadd double %.136.i, %.132.i
  %.142.i = fmul double %arg.rig.12, %.90.i
  %.144.i = fsub double %.142.i, %.120.i
  %.145.i = fmul double %.144.i, 5.000000e-01
  %.148.i = fsub double %.142.i, %.125.i
  %.149.i = fmul double %.148.i, 5.000000e-01
  %17 = getelementptr double, ptr %arg.x.4, i64 %.1537
  %18 = getelementptr i8, ptr %17, i64 8
  %.1654 = load double, ptr %18, align 8
  %19 = getelementptr i8, ptr %17, i64 32
  %.1684 = load double, ptr %19, align 8
  %.1685 = fsub double %.1654, %.1684
  %.1692 = fsub double %.1685, %.122.i
  %.1695 = fadd double %.122.i46, %.1692
  %20 = getelementptr i8, ptr %17, i64 16
  %.1726 = load double, ptr %20, align 8
  %21 = getelementptr i8, ptr %17, i64 40
  %.1757 = load double, ptr %21, align 8
  %.1758 = fsub double %.1726, %.1757
  %.1765 = fsub double %.1758, %.127.i
  %.1768 = fadd double %.127.i49, %.1765
  %.147.i = fadd double %.146.i, %.1695
  %.149.i66 = fmul double %arg.rig.2.0, %.147.i
  %.150.i = fadd double %arg.rig.0.0, %.149.i66
  %.156.i = fadd double %.146.i, %.1768
  %.158.i = fmul double %arg.rig.2.1, %.156.i
  %.159.i = fadd double %arg.rig.0.1, %.158.i
  %.177.i = fmul double %.175.i, %.150.i
  %.182.i = fmul double %.180.i, %.159.i
  %.183.i = fsub double %.177.i, %.182.i
  %.188.i = fdiv double %.183.i, %.168.i
  %.197.i = fmul double %.195.i, %.159.i
  %.202.i = fmul double %.174.i, %.150.i
  %.203.i = fsub double %.197.i, %.202.i
  %.208.i = fdiv double %.203.i, %.168.i
  %.216.i = fcmp ogt double %.188.i, 0.000000e+00
  %.219.i = fcmp ogt double %.208.i, 0.000000e+00
  %or.cond.i = and i1 %.216.i, %.219.i
  br i1 %or.cond.i, label %B380.endif.endif, label %B412.endif.i

B548.i:                                           ; preds = %B412.endif.i
  %.385.i = fcmp ogt double %.315.i, 0.000000e+00
  br i1 %.385.i, label %B560.endif.i, label %B380.endif.endif

B412.endif.i:                                     ; preds = %B380.endif
  %.304.i = fdiv double %.150.i, %.195.i
  %.315.i = fdiv double %.159.i, %.175.i
  %.335.i = fcmp ogt double %.304.i, 0.000000e+00
  %.339.i = fcmp oge double %.304.i, %.315.i
  %or.cond3.i = and i1 %.335.i, %.339.i
  br i1 %or.cond3.i, label %B380.endif.endif, label %B548.i

B560.endif.i:                                     ; preds = %B548.i
  br label %B380.endif.endif

B380.endif.endif:                                 ; preds = %B412.endif.i, %B380.endif, %B560.endif.i, %B548.i
  %ta.4.0.i = phi double [ 0.000000e+00, %B548.i ], [ %.188.i, %B380.endif ], [ 0.000000e+00, %B560.endif.i ], [ %.304.i, %B412.endif.i ]
  %tb.4.0.i = phi double [ 0.000000e+00, %B548.i ], [ %.208.i, %B380.endif ], [ %.315.i, %B560.endif.i ], [ 0.000000e+00, %B412.endif.i ]
  %cross.2.0.i = phi double [ 0.000000e+00, %B548.i ], [ %.249.i, %B380.endif ], [ 0.000000e+00, %B560.endif.i ], [ 0.000000e+00, %B412.endif.i ]
  %own_b.3.0.i = phi double [ %.327.i, %B548.i ], [ %.280.i, %B380.endif ], [ %.414.i, %B560.endif.i ], [ %.327.i, %B412.endif.i ]
  %own_a.3.0.i = phi double [ %.325.i, %B548.i ], [ %.263.i, %B380.endif ], [ %.325.i, %B560.endif.i ], [ %.372.i, %B412.endif.i ]
  %22 = icmp slt i64 %arg.memory.3.2, 1
  %.451.i = fmul double %.134.i, %own_a.3.0.i
  %.455.i = fmul double %.137.i, %cross.2.0.i
  %.456.i = fadd double %.455.i, %.451.i
  %.457.i = fneg double %.456.i
  %.461.i = fmul double %.134.i, %cross.2.0.i
  %.469.i = fmul double %.137.i, %own_b.3.0.i
  %.470.i = fadd double %.461.i, %.469.i
  %.471.i = fneg double %.470.i
  %.1903 = getelementptr double, ptr %arg.work.5.4, i64 %.1512
  store double %ta.4.0.i, ptr %.1903, align 8
  %.1969 = getelementptr double, ptr %.1406, i64 %.1512
  store double %tb.4.0.i, ptr %.1969, align 8
  %.251.i = fsub double %.1570, %arg.load.3
  %.252.i = fmul double %arg.rig.11, %.251.i
  br i1 %22, label %B328.endif.i, label %B106.lr.ph.i

B106.lr.ph.i:                                     ; preds = %B380.endif.endif
  %23 = icmp ult i64 %arg.memory.3.2, 4
  br i1 %23, label %B106.epil.preheader.i, label %B106.lr.ph.new.i

B106.lr.ph.new.i:                                 ; preds = %B106.lr.ph.i
  %invariant.gep.i = getelementptr double, ptr %arg.memory.1.4, i64 %.150520282042
  br label %B106.i

B106.i:                                           ; preds = %B106.i, %B106.lr.ph.new.i
  %lsr.iv55.i = phi ptr [ %scevgep300, %B106.i ], [ %invariant.gep.i, %B106.lr.ph.new.i ]
  %moment.5.0719.i = phi double [ %moment.6.1.3.i, %B106.i ], [ %.252.i, %B106.lr.ph.new.i ]
  %slope.4.0718.i = phi double [ %slope.5.1.3.i, %B106.i ], [ %arg.rig.11, %B106.lr.ph.new.i ]
  %.362714716.i = phi i64 [ %.369.3.i, %B106.i ], [ 0, %B106.lr.ph.new.i ]
  %sunkaddr = mul i64 %.362714716.i, 8
  %sunkaddr323 = getelementptr i8, ptr %arg.memory.2.4, i64 %sunkaddr
  %.427.i = load double, ptr %sunkaddr323, align 8, !noalias !14
  %.492.i = load double, ptr %lsr.iv55.i, align 8, !noalias !14
  %.501.i = fsub double %.1570, %.492.i
  %.503.i = fmul double %.427.i, %.501.i
  %sunkaddr324 = mul i64 %.362714716.i, 8
  %sunkaddr325 = getelementptr i8, ptr %arg.memory.3.4, i64 %sunkaddr324
  %.539.i = load double, ptr %sunkaddr325, align 8, !noalias !14
  %.543.i = fmul double %arg.load.2, %.539.i
  %.551.i68 = tail call double @llvm.fabs.f64(double %.503.i)
  %.553.i = fcmp ugt double %.551.i68, %.543.i
  %.569.i69 = fadd double %slope.4.0718.i, %.427.i
  %.587.i = tail call double @llvm.copysign.f64(double %.543.i, double %.503.i)
  %.503.pn.i = select i1 %.553.i, double %.587.i, double %.503.i
  %slope.5.1.i = select i1 %.553.i, double %slope.4.0718.i, double %.569.i69
  %moment.6.1.i = fadd double %moment.5.0719.i, %.503.pn.i
  %sunkaddr326 = mul i64 %.362714716.i, 8
  %sunkaddr327 = getelementptr i8, ptr %arg.memory.2.4, i64 %sunkaddr326
  %sunkaddr328 = getelementptr i8, ptr %sunkaddr327, i64 8
  %.427.1.i = load double, ptr %sunkaddr328, align 8, !noalias !14
  %sunkaddr76.i = getelementptr i8, ptr %lsr.iv55.i, i64 %sunkaddr75.i
  %.492.1.i = load double, ptr %sunkaddr76.i, align 8, !noalias !14
  %.501.1.i = fsub double %.1570, %.492.1.i
  %.503.1.i = fmul double %.427.1.i, %.501.1.i
  %sunkaddr329 = mul i64 %.362714716.i, 8
  %sunkaddr330 = getelementptr i8, ptr %arg.memory.3.4, i64 %sunkaddr329
  %sunkaddr331 = getelementptr i8, ptr %sunkaddr330, i64 8
  %.539.1.i = load double, ptr %sunkaddr331, align 8, !noalias !14
  %.543.1.i = fmul double %arg.load.2, %.539.1.i
  %.551.1.i = tail call double @llvm.fabs.f64(double %.503.1.i)
  %.553.1.i = fcmp ugt double %.551.1.i, %.543.1.i
  %.569.1.i = fadd double %.427.1.i, %slope.5.1.i
  %.587.1.i = tail call double @llvm.copysign.f64(double %.543.1.i, double %.503.1.i)
  %.503.pn.1.i = select i1 %.553.1.i, double %.587.1.i, double %.503.1.i
  %slope.5.1.1.i = select i1 %.553.1.i, double %slope.5.1.i, double %.569.1.i
  %moment.6.1.1.i = fadd double %moment.6.1.i, %.503.pn.1.i
  %sunkaddr332 = mul i64 %.362714716.i, 8
  %sunkaddr333 = getelementptr i8, ptr %arg.memory.2.4, i64 %sunkaddr332
  %sunkaddr334 = getelementptr i8, ptr %sunkaddr333, i64 16
  %.427.2.i = load double, ptr %sunkaddr334, align 8, !noalias !14
  %scevgep298 = getelementptr i8, ptr %sunkaddr76.i, i64 %sunkaddr75.i
  %.492.2.i = load double, ptr %scevgep298, align 8, !noalias !14
  %.501.2.i = fsub double %.1570, %.492.2.i
  %.503.2.i = fmul double %.427.2.i, %.501.2.i
  %sunkaddr335 = mul i64 %.362714716.i, 8
  %sunkaddr336 = getelementptr i8, ptr %arg.memory.3.4, i64 %sunkaddr335
  %sunkaddr337 = getelementptr i8, ptr %sunkaddr336, i64 16
  %.539.2.i = load double, ptr %sunkaddr337, align 8, !noalias !14
  %.543.2.i = fmul double %arg.load.2, %.539.2.i
  %.551.2.i = tail call double @llvm.fabs.f64(double %.503.2.i)
  %.553.2.i = fcmp ugt double %.551.2.i, %.543.2.i
  %.569.2.i = fadd double %.427.2.i, %slope.5.1.1.i
  %.587.2.i = tail call double @llvm.copysign.f64(double %.543.2.i, double %.503.2.i)
  %.503.pn.2.i = select i1 %.553.2.i, double %.587.2.i, double %.503.2.i
  %slope.5.1.2.i = select i1 %.553.2.i, double %slope.5.1.1.i, double %.569.2.i
  %moment.6.1.2.i = fadd double %moment.6.1.1.i, %.503.pn.2.i
  %.369.3.i = add nuw nsw i64 %.362714716.i, 4
  %sunkaddr338 = mul i64 %.362714716.i, 8
  %sunkaddr339 = getelementptr i8, ptr %arg.memory.2.4, i64 %sunkaddr338
  %sunkaddr340 = getelementptr i8, ptr %sunkaddr339, i64 24
  %.427.3.i = load double, ptr %sunkaddr340, align 8, !noalias !14
  %scevgep299 = getelementptr i8, ptr %scevgep298, i64 %sunkaddr75.i
  %.492.3.i = load double, ptr %scevgep299, align 8, !noalias !14
  %.501.3.i = fsub double %.1570, %.492.3.i
  %.503.3.i = fmul double %.427.3.i, %.501.3.i
  %sunkaddr341 = mul i64 %.362714716.i, 8
  %sunkaddr342 = getelementptr i8, ptr %arg.memory.3.4, i64 %sunkaddr341
  %sunkaddr343 = getelementptr i8, ptr %sunkaddr342, i64 24
  %.539.3.i = load double, ptr %sunkaddr343, align 8, !noalias !14
  %.543.3.i = fmul double %arg.load.2, %.539.3.i
  %.551.3.i = tail call double @llvm.fabs.f64(double %.503.3.i)
  %.553.3.i = fcmp ugt double %.551.3.i, %.543.3.i
  %.569.3.i = fadd double %.427.3.i, %slope.5.1.2.i
  %.587.3.i = tail call double @llvm.copysign.f64(double %.543.3.i, double %.503.3.i)
  %.503.pn.3.i = select i1 %.553.3.i, double %.587.3.i, double %.503.3.i
  %slope.5.1.3.i = select i1 %.553.3.i, double %slope.5.1.2.i, double %.569.3.i
  %moment.6.1.3.i = fadd double %moment.6.1.2.i, %.503.pn.3.i
  %niter.ncmp.3.i = icmp eq i64 %unroll_iter.i, %.369.3.i
  %scevgep300 = getelementptr i8, ptr %scevgep299, i64 %sunkaddr75.i
  br i1 %niter.ncmp.3.i, label %B328.endif.loopexit.unr-lcssa.i, label %B106.i

B514.loopexit.unr-lcssa.i:                        ; preds = %B380.endif.endif.i
  %24 = and i64 %arg.memory.5.2, 1
  %25 = icmp eq i64 %24, 0
  br i1 %25, label %B514.i, label %B380.endif.endif.epil.preheader.i

B380.endif.endif.epil.preheader.i:                ; preds = %B380.lr.ph.i, %B514.loopexit.unr-lcssa.i
  %moment.7.0734.epil.init.i = phi double [ %moment.5.0.lcssa.i, %B380.lr.ph.i ], [ %.912.1.i, %B514.loopexit.unr-lcssa.i ]
  %slope.6.0733.epil.init.i = phi double [ %slope.4.0.lcssa.i, %B380.lr.ph.i ], [ %.916.1.i, %B514.loopexit.unr-lcssa.i ]
  %gep740.epil.i = getelementptr double, ptr %invariant.gep725.i, i64 %.804.epil.i
  %.809.epil.i = load double, ptr %gep740.epil.i, align 8, !noalias !14
  %sunkaddr344 = mul i64 %unroll_iter17.i, 8
  %sunkaddr345 = getelementptr i8, ptr %arg.memory.5.4, i64 %sunkaddr344
  %.175.i.epil.i = load double, ptr %sunkaddr345, align 8, !noalias !17
  %sunkaddr346 = mul i64 %unroll_iter17.i, 8
  %sunkaddr347 = getelementptr i8, ptr %arg.memory.6.4, i64 %sunkaddr346
  %.211.i.epil.i = load double, ptr %sunkaddr347, align 8, !noalias !17
  %sunkaddr348 = mul i64 %unroll_iter17.i, 8
  %sunkaddr349 = getelementptr i8, ptr %arg.memory.7.4, i64 %sunkaddr348
  %.247.i.epil.i = load double, ptr %sunkaddr349, align 8, !noalias !17
  %sunkaddr350 = mul i64 %unroll_iter17.i, 8
  %sunkaddr351 = getelementptr i8, ptr %arg.memory.8.4, i64 %sunkaddr350
  %.283.i.epil.i = load double, ptr %sunkaddr351, align 8, !noalias !17
  %sunkaddr352 = mul i64 %unroll_iter17.i, 8
  %sunkaddr353 = getelementptr i8, ptr %arg.memory.9.4, i64 %sunkaddr352
  %.355.i.epil.i = load double, ptr %sunkaddr353, align 8, !noalias !17
  %.57.i.epil.i = fsub double %.251.i, %.809.epil.i
  %.63.i.epil.i = fmul double %.175.i.epil.i, %.57.i.epil.i
  %.65.i.epil.i = fmul double %"$phi50.0.2.0.i.i", %.63.i.epil.i
  %.79.i.epil.i = fsub double %.54.i.i, %.283.i.epil.i
  %.81.i.epil.i = fmul double %.175.i.epil.i, %.79.i.epil.i
  %.87.i.epil.i = fmul double %.54.i.i, %.355.i.epil.i
  %.93.i.epil.i = fdiv double %.355.i.epil.i, %.175.i.epil.i
  %.94.i.epil.i = fsub double 1.000000e+00, %.93.i.epil.i
  %.97.i.epil.i = fmul double %.247.i.epil.i, %.94.i.epil.i
  %.98.i.epil.i = fadd double %.87.i.epil.i, %.97.i.epil.i
  %.118.i.epil.i = fmul double %.211.i.epil.i, %.94.i.epil.i
  %.119.i.epil.i = fadd double %.87.i.epil.i, %.118.i.epil.i
  %.128.i.epil.i = fmul double %.54.i.i, %.175.i.epil.i
  %.12.i.i.epil.i = fcmp olt double %.98.i.epil.i, %.128.i.epil.i
  %.13.i.i.epil.i = select i1 %.12.i.i.epil.i, double %.98.i.epil.i, double %.128.i.epil.i
  %.12.i3.i.epil.i = fcmp ogt double %.81.i.epil.i, %.13.i.i.epil.i
  %.13.i4.i.epil.i = select i1 %.12.i3.i.epil.i, double %.81.i.epil.i, double %.13.i.i.epil.i
  %.12.i1.i.epil.i = fcmp olt double %.119.i.epil.i, %.128.i.epil.i
  %.13.i2.i.epil.i = select i1 %.12.i1.i.epil.i, double %.119.i.epil.i, double %.128.i.epil.i
  %.12.i5.i.epil.i = fcmp ogt double %.81.i.epil.i, %.13.i2.i.epil.i
  %.13.i6.i.epil.i = select i1 %.12.i5.i.epil.i, double %.81.i.epil.i, double %.13.i2.i.epil.i
  %.257.i.epil.i = fcmp olt double %.65.i.epil.i, %.13.i4.i.epil.i
  %.267.i.epil.i = fcmp olt double %.128.i.epil.i, %.98.i.epil.i
  %.277.i.epil.i = fcmp ogt double %.81.i.epil.i, %.98.i.epil.i
  %or.cond.i.epil.i = select i1 %.267.i.epil.i, i1 true, i1 %.277.i.epil.i
  %spec.select.i.epil.i = select i1 %or.cond.i.epil.i, double %.175.i.epil.i, double %.355.i.epil.i
  %slope.4.0.i.epil.i = select i1 %.257.i.epil.i, double %spec.select.i.epil.i, double %.175.i.epil.i
  %moment.3.0.i.epil.i = select i1 %.257.i.epil.i, double %.13.i4.i.epil.i, double %.65.i.epil.i
  %.319.i.epil.i = fcmp ogt double %moment.3.0.i.epil.i, %.13.i6.i.epil.i
  %.333.i.epil.i = fcmp olt double %.128.i.epil.i, %.119.i.epil.i
  %.343.i.epil.i = fcmp ogt double %.81.i.epil.i, %.119.i.epil.i
  %or.cond9.i.epil.i = select i1 %.333.i.epil.i, i1 true, i1 %.343.i.epil.i
  %spec.select10.i.epil.i = select i1 %or.cond9.i.epil.i, double %.175.i.epil.i, double %.355.i.epil.i
  %slope.3.0.i.epil.i = select i1 %.319.i.epil.i, double %spec.select10.i.epil.i, double %slope.4.0.i.epil.i
  %moment.4.0.i.epil.i = select i1 %.319.i.epil.i, double %.13.i6.i.epil.i, double %moment.3.0.i.epil.i
  %.395.i.epil.i = fmul double %"$phi50.0.2.0.i.i", %moment.4.0.i.epil.i
  %.912.epil.i = fadd double %moment.7.0734.epil.init.i, %.395.i.epil.i
  %.916.epil.i = fadd double %slope.6.0733.epil.init.i, %slope.3.0.i.epil.i
  br label %B514.i

B514.i:                                           ; preds = %B328.endif.i, %B380.endif.endif.epil.preheader.i, %B514.loopexit.unr-lcssa.i
  %slope.6.0.lcssa.i = phi double [ %slope.4.0.lcssa.i, %B328.endif.i ], [ %.916.1.i, %B514.loopexit.unr-lcssa.i ], [ %.916.epil.i, %B380.endif.endif.epil.preheader.i ]
  %moment.7.0.lcssa.i = phi double [ %moment.5.0.lcssa.i, %B328.endif.i ], [ %.912.1.i, %B514.loopexit.unr-lcssa.i ], [ %.912.epil.i, %B380.endif.endif.epil.preheader.i ]
  %26 = icmp ne i8 %arg.rig.20, 0
  %.977.i = tail call double @llvm.fabs.f64(double %.1570)
  %.980.i = fsub double %.977.i, %arg.rig.18
  %.985.i = fcmp ogt double %.980.i, 0.000000e+00
  %.992.i = fcmp ogt double %.1570, 0.000000e+00
  %brmerge.i = or i1 %26, %.992.i
  %or.cond.i77 = select i1 %.985.i, i1 %brmerge.i, i1 false
  br i1 %or.cond.i77, label %B598.i, label %B380.endif.endif.endif.en...endif.endif

B598.i:                                           ; preds = %B514.i
  %.1006.i = fmul double %arg.rig.19, %.980.i
  %.1010.i = tail call double @llvm.copysign.f64(double %.1006.i, double %.1570)
  %.1014.i = fadd double %.1010.i, %moment.7.0.lcssa.i
  %.1038.i = fadd double %arg.rig.19, %slope.6.0.lcssa.i
  br label %B380.endif.endif.endif.en...endif.endif

B328.endif.loopexit.unr-lcssa.i:                  ; preds = %B106.i
  %27 = icmp eq i64 %xtraiter.i, 0
  br i1 %27, label %B328.endif.i, label %B106.epil.preheader.i

B106.epil.preheader.i:                            ; preds = %B328.endif.loopexit.unr-lcssa.i, %B106.lr.ph.i
  %moment.5.0719.epil.init.i = phi double [ %.252.i, %B106.lr.ph.i ], [ %moment.6.1.3.i, %B328.endif.loopexit.unr-lcssa.i ]
  %slope.4.0718.epil.init.i = phi double [ %arg.rig.11, %B106.lr.ph.i ], [ %slope.5.1.3.i, %B328.endif.loopexit.unr-lcssa.i ]
  %.362714716.epil.init.i = phi i64 [ 0, %B106.lr.ph.i ], [ %unroll_iter.i, %B328.endif.loopexit.unr-lcssa.i ]
  %28 = shl i64 %.362714716.epil.init.i, 3
  %scevgep40.i = getelementptr i8, ptr %arg.memory.3.4, i64 %28
  %29 = mul i64 %.362714716.epil.init.i, %arg.memory.1.5.1
  %30 = add i64 %29, %.150520282042
  %31 = shl i64 %30, 3
  %scevgep42.i = getelementptr i8, ptr %arg.memory.1.4, i64 %31
  %scevgep45.i = getelementptr i8, ptr %arg.memory.2.4, i64 %28
  br label %B106.epil.i

B106.epil.i:                                      ; preds = %B106.epil.i, %B106.epil.preheader.i
  %lsr.iv43.i = phi ptr [ %scevgep44.i, %B106.epil.i ], [ %scevgep42.i, %B106.epil.preheader.i ]
  %moment.5.0719.epil.i = phi double [ %moment.6.1.epil.i, %B106.epil.i ], [ %moment.5.0719.epil.init.i, %B106.epil.preheader.i ]
  %slope.4.0718.epil.i = phi double [ %slope.5.1.epil.i, %B106.epil.i ], [ %slope.4.0718.epil.init.i, %B106.epil.preheader.i ]
  %epil.iter.i = phi i64 [ %epil.iter.next.i, %B106.epil.i ], [ 0, %B106.epil.preheader.i ]
  %32 = shl i64 %epil.iter.i, 3
  %scevgep302 = getelementptr i8, ptr %scevgep45.i, i64 %32
  %.427.epil.i = load double, ptr %scevgep302, align 8, !noalias !14
  %.492.epil.i = load double, ptr %lsr.iv43.i, align 8, !noalias !14
  %.501.epil.i = fsub double %.1570, %.492.epil.i
  %.503.epil.i = fmul double %.427.epil.i, %.501.epil.i
  %33 = shl i64 %epil.iter.i, 3
  %scevgep301 = getelementptr i8, ptr %scevgep40.i, i64 %33
  %.539.epil.i = load double, ptr %scevgep301, align 8, !noalias !14
  %.543.epil.i = fmul double %arg.load.2, %.539.epil.i
  %.551.epil.i = tail call double @llvm.fabs.f64(double %.503.epil.i)
  %.553.epil.i = fcmp ugt double %.551.epil.i, %.543.epil.i
  %.569.epil.i = fadd double %slope.4.0718.epil.i, %.427.epil.i
  %.587.epil.i = tail call double @llvm.copysign.f64(double %.543.epil.i, double %.503.epil.i)
  %.503.pn.epil.i = select i1 %.553.epil.i, double %.587.epil.i, double %.503.epil.i
  %slope.5.1.epil.i = select i1 %.553.epil.i, double %slope.4.0718.epil.i, double %.569.epil.i
  %moment.6.1.epil.i = fadd double %moment.5.0719.epil.i, %.503.pn.epil.i
  %epil.iter.next.i = add i64 %epil.iter.i, 1
  %scevgep44.i = getelementptr i8, ptr %lsr.iv43.i, i64 %sunkaddr75.i
  %epil.iter.cmp.not.i = icmp eq i64 %xtraiter.i, %epil.iter.next.i
  br i1 %epil.iter.cmp.not.i, label %B328.endif.i, label %B106.epil.i, !llvm.loop !20

B328.endif.i:                                     ; preds = %B106.epil.i, %B328.endif.loopexit.unr-lcssa.i, %B380.endif.endif
  %slope.4.0.lcssa.i = phi double [ %arg.rig.11, %B380.endif.endif ], [ %slope.5.1.3.i, %B328.endif.loopexit.unr-lcssa.i ], [ %slope.5.1.epil.i, %B106.epil.i ]
  %moment.5.0.lcssa.i = phi double [ %.252.i, %B380.endif.endif ], [ %moment.6.1.3.i, %B328.endif.loopexit.unr-lcssa.i ], [ %moment.6.1.epil.i, %B106.epil.i ]
  %34 = icmp slt i64 %arg.memory.5.2, 1
  br i1 %34, label %B514.i, label %B380.lr.ph.i

B380.lr.ph.i:                                     ; preds = %B328.endif.i
  %35 = icmp eq i64 %arg.memory.5.2, 1
  %invariant.gep725.i = getelementptr double, ptr %arg.memory.4.4, i64 %.150520282042
  %.38.i.i = fcmp oge double %.251.i, 0.000000e+00
  %"$phi50.0.2.0.i.i" = select i1 %.38.i.i, double 1.000000e+00, double -1.000000e+00
  %.54.i.i = tail call double @llvm.fabs.f64(double %.251.i)
  br i1 %35, label %B380.endif.endif.epil.preheader.i, label %B380.endif.endif.i.preheader

B380.endif.endif.i.preheader:                     ; preds = %B380.lr.ph.i
  br label %B380.endif.endif.i

B380.endif.endif.i:                               ; preds = %B380.endif.endif.i.preheader, %B380.endif.endif.i
  %lsr.iv.i = phi ptr [ %scevgep.i, %B380.endif.endif.i ], [ %invariant.gep725.i, %B380.endif.endif.i.preheader ]
  %moment.7.0734.i = phi double [ %.912.1.i, %B380.endif.endif.i ], [ %moment.5.0.lcssa.i, %B380.endif.endif.i.preheader ]
  %slope.6.0733.i = phi double [ %.916.1.i, %B380.endif.endif.i ], [ %slope.4.0.lcssa.i, %B380.endif.endif.i.preheader ]
  %.714728731.i = phi i64 [ %.721.1.i, %B380.endif.endif.i ], [ 0, %B380.endif.endif.i.preheader ]
  %.809.i = load double, ptr %lsr.iv.i, align 8, !noalias !14
  %sunkaddr354 = mul i64 %.714728731.i, 8
  %sunkaddr355 = getelementptr i8, ptr %arg.memory.5.4, i64 %sunkaddr354
  %.175.i.i = load double, ptr %sunkaddr355, align 8, !noalias !17
  %sunkaddr356 = mul i64 %.714728731.i, 8
  %sunkaddr357 = getelementptr i8, ptr %arg.memory.6.4, i64 %sunkaddr356
  %.211.i.i = load double, ptr %sunkaddr357, align 8, !noalias !17
  %sunkaddr358 = mul i64 %.714728731.i, 8
  %sunkaddr359 = getelementptr i8, ptr %arg.memory.7.4, i64 %sunkaddr358
  %.247.i.i = load double, ptr %sunkaddr359, align 8, !noalias !17
  %sunkaddr360 = mul i64 %.714728731.i, 8
  %sunkaddr361 = getelementptr i8, ptr %arg.memory.8.4, i64 %sunkaddr360
  %.283.i.i = load double, ptr %sunkaddr361, align 8, !noalias !17
  %sunkaddr362 = mul i64 %.714728731.i, 8
  %sunkaddr363 = getelementptr i8, ptr %arg.memory.9.4, i64 %sunkaddr362
  %.355.i.i = load double, ptr %sunkaddr363, align 8, !noalias !17
  %.57.i.i = fsub double %.251.i, %.809.i
  %.63.i.i = fmul double %.175.i.i, %.57.i.i
  %.65.i.i = fmul double %"$phi50.0.2.0.i.i", %.63.i.i
  %.79.i.i = fsub double %.54.i.i, %.283.i.i
  %.81.i.i = fmul double %.175.i.i, %.79.i.i
  %.87.i.i = fmul double %.54.i.i, %.355.i.i
  %.93.i.i = fdiv double %.355.i.i, %.175.i.i
  %.94.i.i = fsub double 1.000000e+00, %.93.i.i
  %.97.i.i = fmul double %.247.i.i, %.94.i.i
  %.98.i.i = fadd double %.87.i.i, %.97.i.i
  %.118.i.i = fmul double %.211.i.i, %.94.i.i
  %.119.i.i = fadd double %.87.i.i, %.118.i.i
  %.128.i.i = fmul double %.54.i.i, %.175.i.i
  %.12.i.i.i70 = fcmp olt double %.98.i.i, %.128.i.i
  %.13.i.i.i71 = select i1 %.12.i.i.i70, double %.98.i.i, double %.128.i.i
  %.12.i3.i.i72 = fcmp ogt double %.81.i.i, %.13.i.i.i71
  %.13.i4.i.i73 = select i1 %.12.i3.i.i72, double %.81.i.i, double %.13.i.i.i71
  %.12.i1.i.i74 = fcmp olt double %.119.i.i, %.128.i.i
  %.13.i2.i.i75 = select i1 %.12.i1.i.i74, double %.119.i.i, double %.128.i.i
  %.12.i5.i.i = fcmp ogt double %.81.i.i, %.13.i2.i.i75
  %.13.i6.i.i = select i1 %.12.i5.i.i, double %.81.i.i, double %.13.i2.i.i75
  %.257.i.i = fcmp olt double %.65.i.i, %.13.i4.i.i73
  %.267.i.i = fcmp olt double %.128.i.i, %.98.i.i
  %.277.i.i = fcmp ogt double %.81.i.i, %.98.i.i
  %or.cond.i.i76 = select i1 %.267.i.i, i1 true, i1 %.277.i.i
  %spec.select.i.i = select i1 %or.cond.i.i76, double %.175.i.i, double %.355.i.i
  %slope.4.0.i.i = select i1 %.257.i.i, double %spec.select.i.i, double %.175.i.i
  %moment.3.0.i.i = select i1 %.257.i.i, double %.13.i4.i.i73, double %.65.i.i
  %.319.i.i = fcmp ogt double %moment.3.0.i.i, %.13.i6.i.i
  %.333.i.i = fcmp olt double %.128.i.i, %.119.i.i
  %.343.i.i = fcmp ogt double %.81.i.i, %.119.i.i
  %or.cond9.i.i = select i1 %.333.i.i, i1 true, i1 %.343.i.i
  %spec.select10.i.i = select i1 %or.cond9.i.i, double %.175.i.i, double %.355.i.i
  %slope.3.0.i.i = select i1 %.319.i.i, double %spec.select10.i.i, double %slope.4.0.i.i
  %moment.4.0.i.i = select i1 %.319.i.i, double %.13.i6.i.i, double %moment.3.0.i.i
  %.395.i.i = fmul double %"$phi50.0.2.0.i.i", %moment.4.0.i.i
  %.912.i = fadd double %moment.7.0734.i, %.395.i.i
  %.916.i = fadd double %slope.6.0733.i, %slope.3.0.i.i
  %.721.1.i = add nuw i64 %.714728731.i, 2
  %sunkaddr364 = mul i64 %arg.memory.4.5.1, 8
  %sunkaddr365 = getelementptr i8, ptr %lsr.iv.i, i64 %sunkaddr364
  %.809.1.i = load double, ptr %sunkaddr365, align 8, !noalias !14
  %sunkaddr366 = mul i64 %.714728731.i, 8
  %sunkaddr367 = getelementptr i8, ptr %arg.memory.5.4, i64 %sunkaddr366
  %sunkaddr368 = getelementptr i8, ptr %sunkaddr367, i64 8
  %.175.i.1.i = load double, ptr %sunkaddr368, align 8, !noalias !17
  %sunkaddr369 = mul i64 %.714728731.i, 8
  %sunkaddr370 = getelementptr i8, ptr %arg.memory.6.4, i64 %sunkaddr369
  %sunkaddr371 = getelementptr i8, ptr %sunkaddr370, i64 8
  %.211.i.1.i = load double, ptr %sunkaddr371, align 8, !noalias !17
  %sunkaddr372 = mul i64 %.714728731.i, 8
  %sunkaddr373 = getelementptr i8, ptr %arg.memory.7.4, i64 %sunkaddr372
  %sunkaddr374 = getelementptr i8, ptr %sunkaddr373, i64 8
  %.247.i.1.i = load double, ptr %sunkaddr374, align 8, !noalias !17
  %sunkaddr375 = mul i64 %.714728731.i, 8
  %sunkaddr376 = getelementptr i8, ptr %arg.memory.8.4, i64 %sunkaddr375
  %sunkaddr377 = getelementptr i8, ptr %sunkaddr376, i64 8
  %.283.i.1.i = load double, ptr %sunkaddr377, align 8, !noalias !17
  %sunkaddr378 = mul i64 %.714728731.i, 8
  %sunkaddr379 = getelementptr i8, ptr %arg.memory.9.4, i64 %sunkaddr378
  %sunkaddr380 = getelementptr i8, ptr %sunkaddr379, i64 8
  %.355.i.1.i = load double, ptr %sunkaddr380, align 8, !noalias !17
  %.57.i.1.i = fsub double %.251.i, %.809.1.i
  %.63.i.1.i = fmul double %.175.i.1.i, %.57.i.1.i
  %.65.i.1.i = fmul double %"$phi50.0.2.0.i.i", %.63.i.1.i
  %.79.i.1.i = fsub double %.54.i.i, %.283.i.1.i
  %.81.i.1.i = fmul double %.175.i.1.i, %.79.i.1.i
  %.87.i.1.i = fmul double %.54.i.i, %.355.i.1.i
  %.93.i.1.i = fdiv double %.355.i.1.i, %.175.i.1.i
  %.94.i.1.i = fsub double 1.000000e+00, %.93.i.1.i
  %.97.i.1.i = fmul double %.247.i.1.i, %.94.i.1.i
  %.98.i.1.i = fadd double %.87.i.1.i, %.97.i.1.i
  %.118.i.1.i = fmul double %.211.i.1.i, %.94.i.1.i
  %.119.i.1.i = fadd double %.87.i.1.i, %.118.i.1.i
  %.128.i.1.i = fmul double %.54.i.i, %.175.i.1.i
  %.12.i.i.1.i = fcmp olt double %.98.i.1.i, %.128.i.1.i
  %.13.i.i.1.i = select i1 %.12.i.i.1.i, double %.98.i.1.i, double %.128.i.1.i
  %.12.i3.i.1.i = fcmp ogt double %.81.i.1.i, %.13.i.i.1.i
  %.13.i4.i.1.i = select i1 %.12.i3.i.1.i, double %.81.i.1.i, double %.13.i.i.1.i
  %.12.i1.i.1.i = fcmp olt double %.119.i.1.i, %.128.i.1.i
  %.13.i2.i.1.i = select i1 %.12.i1.i.1.i, double %.119.i.1.i, double %.128.i.1.i
  %.12.i5.i.1.i = fcmp ogt double %.81.i.1.i, %.13.i2.i.1.i
  %.13.i6.i.1.i = select i1 %.12.i5.i.1.i, double %.81.i.1.i, double %.13.i2.i.1.i
  %.257.i.1.i = fcmp olt double %.65.i.1.i, %.13.i4.i.1.i
  %.267.i.1.i = fcmp olt double %.128.i.1.i, %.98.i.1.i
  %.277.i.1.i = fcmp ogt double %.81.i.1.i, %.98.i.1.i
  %or.cond.i.1.i = select i1 %.267.i.1.i, i1 true, i1 %.277.i.1.i
  %spec.select.i.1.i = select i1 %or.cond.i.1.i, double %.175.i.1.i, double %.355.i.1.i
  %slope.4.0.i.1.i = select i1 %.257.i.1.i, double %spec.select.i.1.i, double %.175.i.1.i
  %moment.3.0.i.1.i = select i1 %.257.i.1.i, double %.13.i4.i.1.i, double %.65.i.1.i
  %.319.i.1.i = fcmp ogt double %moment.3.0.i.1.i, %.13.i6.i.1.i
  %.333.i.1.i = fcmp olt double %.128.i.1.i, %.119.i.1.i
  %.343.i.1.i = fcmp ogt double %.81.i.1.i, %.119.i.1.i
  %or.cond9.i.1.i = select i1 %.333.i.1.i, i1 true, i1 %.343.i.1.i
  %spec.select10.i.1.i = select i1 %or.cond9.i.1.i, double %.175.i.1.i, double %.355.i.1.i
  %slope.3.0.i.1.i = select i1 %.319.i.1.i, double %spec.select10.i.1.i, double %slope.4.0.i.1.i
  %moment.4.0.i.1.i = select i1 %.319.i.1.i, double %.13.i6.i.1.i, double %moment.3.0.i.1.i
  %.395.i.1.i = fmul double %"$phi50.0.2.0.i.i", %moment.4.0.i.1.i
  %.912.1.i = fadd double %.912.i, %.395.i.1.i
  %.916.1.i = fadd double %.916.i, %slope.3.0.i.1.i
  %scevgep.i = getelementptr i8, ptr %lsr.iv.i, i64 %15
  %niter18.ncmp.1.i = icmp eq i64 %unroll_iter17.i, %.721.1.i
  br i1 %niter18.ncmp.1.i, label %B514.loopexit.unr-lcssa.i, label %B380.endif.endif.i

B380.endif.endif.endif.en...endif.endif:          ; preds = %B514.i, %B598.i
  %slope.7.0.i = phi double [ %.1038.i, %B598.i ], [ %slope.6.0.lcssa.i, %B514.i ]
  %moment.8.0.i = phi double [ %.1014.i, %B598.i ], [ %moment.7.0.lcssa.i, %B514.i ]
  %sunkaddr381 = mul i64 %.1537, 8
  %sunkaddr382 = getelementptr i8, ptr %arg.work.8.4, i64 %sunkaddr381
  %sunkaddr383 = getelementptr i8, ptr %sunkaddr382, i64 24
  %.2093 = load double, ptr %sunkaddr383, align 8
  %.2097 = fsub double %.1570, %.2093
  %.2098 = fmul double %.2059, %.2097
  %.2099 = fadd double %moment.8.0.i, %.2098
  %.2100 = fmul double %.134.i, %ta.4.0.i
  %.2101 = fsub double %.2099, %.2100
  %.2102 = fmul double %.137.i, %tb.4.0.i
  %.2103 = fsub double %.2101, %.2102
  %36 = getelementptr double, ptr %arg.work.3.4, i64 %.150520282042
  %.2137 = load double, ptr %36, align 8
  %.2141 = fsub double %.2103, %.2137
  %sunkaddr384 = mul i64 %.1537, 8
  %sunkaddr385 = getelementptr i8, ptr %arg.work.1.4, i64 %sunkaddr384
  %sunkaddr386 = getelementptr i8, ptr %sunkaddr385, i64 24
  store double %.2141, ptr %sunkaddr386, align 8
  %.2202 = tail call double @llvm.fabs.f64(double %.2141)
  %.2213 = fdiv double %.2202, %arg.rig.1.0
  %.12.i = fcmp ogt double %.2213, %largest.3.02051
  %.13.i = select i1 %.12.i, double %.2213, double %largest.3.02051
  %.2244 = fadd double %.2059, %slope.7.0.i
  %.2251 = fmul double %.145.i, %ta.4.0.i
  %.2252 = fsub double %.2244, %.2251
  %.2268 = fmul double %.149.i, %tb.4.0.i
  %.2269 = fsub double %.2252, %.2268
  %37 = fmul double %.134.i, %.456.i
  %.2277 = fadd double %37, %.2269
  %38 = fmul double %.137.i, %.470.i
  %.2285 = fadd double %38, %.2277
  %.72.i12 = mul i64 %.1540, %arg.work.0.5.1
  %39 = getelementptr double, ptr %arg.work.0.4, i64 %.72.i12
  %40 = getelementptr i8, ptr %39, i64 40
  %.77.i13 = load double, ptr %40, align 8, !noalias !22
  %.78.i14 = fadd double %.2285, %.77.i13
  store double %.78.i14, ptr %40, align 8, !noalias !22
  %41 = getelementptr i8, ptr %39, i64 24
  %.77.i19 = load double, ptr %41, align 8, !noalias !25
  %.78.i20 = fsub double %.77.i19, %.456.i
  store double %.78.i20, ptr %41, align 8, !noalias !25
  %42 = getelementptr i8, ptr %39, i64 32
  %.77.i25 = load double, ptr %42, align 8, !noalias !28
  %.78.i26 = fsub double %.77.i25, %.470.i
  store double %.78.i26, ptr %42, align 8, !noalias !28
  %43 = getelementptr i8, ptr %39, i64 48
  %.77.i31 = load double, ptr %43, align 8, !noalias !31
  %.78.i32 = fadd double %.456.i, %.77.i31
  store double %.78.i32, ptr %43, align 8, !noalias !31
  %44 = getelementptr i8, ptr %39, i64 56
  %.77.i37 = load double, ptr %44, align 8, !noalias !34
  %.78.i38 = fadd double %.470.i, %.77.i37
  store double %.78.i38, ptr %44, align 8, !noalias !34
  %sunkaddr387 = mul i64 %.1537, 8
  %sunkaddr388 = getelementptr i8, ptr %arg.x.4, i64 %sunkaddr387
  %.2484 = load double, ptr %sunkaddr388, align 8
  %.202.i78 = fcmp ogt double %.2484, 0.000000e+00
  br i1 %.202.i78, label %B196.i, label %B178.i

B178.i:                                           ; preds = %B380.endif.endif.endif.en...endif.endif
  %.211.i = fcmp olt double %.2484, 0.000000e+00
  br i1 %.211.i, label %B196.i, label %B194.i

B194.i:                                           ; preds = %B178.i
  br label %B196.i

B196.i:                                           ; preds = %B194.i, %B178.i, %B380.endif.endif.endif.en...endif.endif
  %"$phi196.0.3.0.i" = phi double [ 0.000000e+00, %B194.i ], [ 5.000000e-01, %B380.endif.endif.endif.en...endif.endif ], [ -5.000000e-01, %B178.i ]
  %45 = fcmp ogt double %.1570, 0.000000e+00
  br i1 %45, label %B380.endif.endif.endif.en...endif.endif.endif, label %B214.i

B214.i:                                           ; preds = %B196.i
  %.237.i = fcmp olt double %.1570, 0.000000e+00
  br i1 %.237.i, label %B380.endif.endif.endif.en...endif.endif.endif, label %B230.i

B230.i:                                           ; preds = %B214.i
  br label %B380.endif.endif.endif.en...endif.endif.endif

B380.endif.endif.endif.en...endif.endif.endif:    ; preds = %B230.i, %B214.i, %B196.i
  %"$phi232.0.3.0.i" = phi double [ 0.000000e+00, %B230.i ], [ 5.000000e-01, %B196.i ], [ -5.000000e-01, %B214.i ]
  %46 = fcmp oeq double %arg.rig.14, 0.000000e+00
  %47 = icmp eq i8 %arg.settle, 0
  %.168.i79 = icmp eq i64 %.150520282042, 0
  %.145.i80 = tail call double @llvm.fabs.f64(double %.2484)
  %.146.i81 = fadd double %.977.i, %.145.i80
  %.147.i82 = fmul double %.146.i81, 5.000000e-01
  %.173.i = fadd double %arg.rig.17, %.147.i82
  %wrap.2.0.i = select i1 %.168.i79, double %.173.i, double %.147.i82
  %constant.2.0.i = select i1 %.168.i79, double %.181.i, double %arg.rig.15
  %drag.2.0.i = select i1 %.168.i79, double %.189.i, double 0.000000e+00
  %.254.i = fmul double %.252.i83, %wrap.2.0.i
  %.257.i = tail call double @tanh(double %.254.i)
  %.542.i = add nuw nsw i64 %.1537, 1
  %.699.i = fadd double %near.2.sroa.0.02050, %ta.4.0.i
  %48 = getelementptr double, ptr %arg.x.4, i64 %.542.i
  %.730.i = load double, ptr %48, align 8, !noalias !37
  %49 = getelementptr double, ptr %arg.memory.0.4, i64 %.150520282042
  %.827.i = load double, ptr %49, align 8, !noalias !37
  %.833.i = fsub double %.730.i, %.827.i
  %.835.i = fmul double %arg.rig.5.0, %.833.i
  %.851.i = fmul double %.699.i, %.257.i
  %.852.i = fadd double %constant.2.0.i, %.851.i
  %.872.i = fcmp oeq double %constant.2.0.i, 0.000000e+00
  %or.cond.i156 = select i1 %46, i1 %.872.i, i1 false
  %bristle.2.0.i = select i1 %or.cond.i156, double 0.000000e+00, double %arg.rig.5.0
  %pull.2.0.i = select i1 %or.cond.i156, double 0.000000e+00, double %.835.i
  %50 = getelementptr double, ptr %arg.work.7.4, i64 %.150520282042
  %.944.i = load double, ptr %50, align 8, !noalias !37
  br i1 %47, label %B468.i, label %B398.i

B398.i:                                           ; preds = %B380.endif.endif.endif.en...endif.endif.endif
  %.17.i.i = fcmp oeq double %.944.i, 0.000000e+00
  br i1 %.17.i.i, label %B16.i.i, label %B106.i.i

B16.i.i:                                          ; preds = %B398.i
  %.22.i.i = tail call double @llvm.fabs.f64(double %pull.2.0.i)
  %.25.i.i = fadd double %arg.rig.28, %.852.i
  %.30.i.i = fcmp ogt double %.22.i.i, %.25.i.i
  %.33.i.i = tail call double @llvm.copysign.f64(double 1.000000e+00, double %pull.2.0.i)
  %"$phi104.0.2.0.i.i" = select i1 %.30.i.i, double %.33.i.i, double 0.000000e+00
  br label %B398.endif.i

B106.i.i:                                         ; preds = %B398.i
  %.52.i.i = fmul double %.944.i, %pull.2.0.i
  %.57.i.i157 = fsub double %.852.i, %arg.rig.28
  %.62.i.i = fcmp olt double %.52.i.i, %.57.i.i157
  %"$phi136.0.2.0.i.i" = select i1 %.62.i.i, double 0.000000e+00, double %.944.i
  br label %B398.endif.i

B468.i:                                           ; preds = %B398.endif.i, %B380.endif.endif.endif.en...endif.endif.endif
  %state.2.0.i = phi double [ %storemerge.i.i, %B398.endif.i ], [ %.944.i, %B380.endif.endif.endif.en...endif.endif.endif ]
  %51 = getelementptr double, ptr %arg.work.6.4, i64 %.150520282042
  store double %.852.i, ptr %51, align 8, !noalias !37
  %.68.i.i = fcmp oeq double %state.2.0.i, 0.000000e+00
  br i1 %.68.i.i, label %B468.endif.endif.endif.i, label %B54.i.i

B54.i.i:                                          ; preds = %B468.i
  %.126.i.i = fmul double %.852.i, %state.2.0.i
  %.130.i.i = fmul double %.257.i, %state.2.0.i
  %.133.i.i = fmul double %.699.i, %state.2.0.i
  %.138.i.i = fmul double %.133.i.i, 5.000000e-01
  %.141.i.i = fmul double %arg.rig.14, %.138.i.i
  %.162.i.i = fmul double %.257.i, %.257.i
  %.163.i.i = fsub double 1.000000e+00, %.162.i.i
  %.164.i.i = fmul double %.163.i.i, %.141.i.i
  br label %B468.endif.endif.endif.i

B398.endif.i:                                     ; preds = %B106.i.i, %B16.i.i
  %storemerge.i.i = phi double [ %"$phi136.0.2.0.i.i", %B106.i.i ], [ %"$phi104.0.2.0.i.i", %B16.i.i ]
  %sunkaddr389 = mul i64 %.150520282042, 8
  %sunkaddr390 = getelementptr i8, ptr %arg.work.7.4, i64 %sunkaddr389
  store double %storemerge.i.i, ptr %sunkaddr390, align 8, !noalias !37
  br label %B468.i

B468.endif.endif.endif.i:                         ; preds = %B54.i.i, %B468.i
  %.126.sink.i.i = phi double [ %.126.i.i, %B54.i.i ], [ %pull.2.0.i, %B468.i ]
  %.sink.i.i = phi double [ 0.000000e+00, %B54.i.i ], [ %bristle.2.0.i, %B468.i ]
  %.130.sink.i.i = phi double [ %.130.i.i, %B54.i.i ], [ 0.000000e+00, %B468.i ]
  %.164.sink.i.i = phi double [ %.164.i.i, %B54.i.i ], [ 0.000000e+00, %B468.i ]
  %52 = icmp eq i64 %.150520282042, 0
  %.1254.i = fsub double %near.2.sroa.0.02050, %ta.4.0.i
  %.1257.i = fsub double %.1254.i, %.126.sink.i.i
  %sunkaddr391 = mul i64 %.1537, 8
  %sunkaddr392 = getelementptr i8, ptr %arg.x.4, i64 %sunkaddr391
  %sunkaddr393 = getelementptr i8, ptr %sunkaddr392, i64 8
  %.1290.i = load double, ptr %sunkaddr393, align 8, !noalias !37
  %sunkaddr394 = mul i64 %.1537, 8
  %sunkaddr395 = getelementptr i8, ptr %arg.work.8.4, i64 %sunkaddr394
  %sunkaddr396 = getelementptr i8, ptr %sunkaddr395, i64 8
  %.1330.i = load double, ptr %sunkaddr396, align 8, !noalias !37
  %.1334.i = fsub double %.1290.i, %.1330.i
  %.1335.i = fmul double %drag.2.0.i, %.1334.i
  %.1336.i = fsub double %.1257.i, %.1335.i
  %sunkaddr397 = mul i64 %.1537, 8
  %sunkaddr398 = getelementptr i8, ptr %arg.work.1.4, i64 %sunkaddr397
  %sunkaddr399 = getelementptr i8, ptr %sunkaddr398, i64 8
  store double %.1336.i, ptr %sunkaddr399, align 8, !noalias !37
  %.1424.i = fsub double 1.000000e+00, %.130.sink.i.i
  %.1427.i = fadd double %.130.sink.i.i, 1.000000e+00
  br i1 %52, label %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i, label %B744.endif.endif.endif.endif.i

B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i: ; preds = %B468.endif.endif.endif.i
  %.pre.i = fmul double %near.2.sroa.16.02048, %.1424.i
  %.pre91.i = fmul double %near.2.sroa.32.02046, %.1424.i
  %.pre = mul nuw i64 %.542.i, %arg.work.0.5.1
  br label %B1108.endif.endif.endif.e...endif.i

B744.endif.endif.endif.endif.i:                   ; preds = %B468.endif.endif.endif.i
  %.1492.i = fmul double %near.2.sroa.40.02045, %.1424.i
  %.72.i.i = mul i64 %.542.i, %arg.work.0.5.1
  %53 = getelementptr double, ptr %arg.work.0.4, i64 %.72.i.i
  %54 = getelementptr i8, ptr %53, i64 32
  %.77.i.i = load double, ptr %54, align 8, !noalias !40
  %.78.i.i = fadd double %.1492.i, %.77.i.i
  store double %.78.i.i, ptr %54, align 8, !noalias !40
  %.1561.i = fmul double %near.2.sroa.16.02048, %.1424.i
  %55 = getelementptr i8, ptr %53, i64 16
  %.77.i22.i = load double, ptr %55, align 8, !noalias !43
  %.78.i23.i = fadd double %.1561.i, %.77.i22.i
  store double %.78.i23.i, ptr %55, align 8, !noalias !43
  %.1598.i = fmul double %near.2.sroa.32.02046, %.1424.i
  %56 = getelementptr i8, ptr %53, i64 24
  %.77.i29.i = load double, ptr %56, align 8, !noalias !46
  %.78.i30.i = fadd double %.1598.i, %.77.i29.i
  store double %.78.i30.i, ptr %56, align 8, !noalias !46
  br label %B1108.endif.endif.endif.e...endif.i

B1108.endif.endif.endif.e...endif.i:              ; preds = %B744.endif.endif.endif.endif.i, %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i
  %.72.i35.i.pre-phi = phi i64 [ %.72.i.i, %B744.endif.endif.endif.endif.i ], [ %.pre, %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i ]
  %.pre-phi92.i = phi double [ %.1598.i, %B744.endif.endif.endif.endif.i ], [ %.pre91.i, %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i ]
  %.pre-phi.i = phi double [ %.1561.i, %B744.endif.endif.endif.endif.i ], [ %.pre.i, %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i ]
  %57 = fcmp oeq double %state.2.0.i, 0.000000e+00
  %58 = getelementptr double, ptr %arg.work.0.4, i64 %.72.i35.i.pre-phi
  %59 = getelementptr i8, ptr %58, i64 40
  %.77.i36.i = load double, ptr %59, align 8, !noalias !49
  %.78.i37.i = fsub double %.77.i36.i, %.pre-phi.i
  %60 = getelementptr i8, ptr %58, i64 48
  %.77.i43.i = load double, ptr %60, align 8, !noalias !52
  %.78.i44.i = fsub double %.77.i43.i, %.pre-phi92.i
  %.1812.i = fmul double %own_a.3.0.i, %.1427.i
  %.1815.i = fadd double %.sink.i.i, %.1812.i
  %.1818.i = fadd double %drag.2.0.i, %.1815.i
  %.1819.i = fadd double %.1772.i, %.1818.i
  %.78.i51.i = fsub double %.78.i37.i, %.1819.i
  store double %.78.i51.i, ptr %59, align 8, !noalias !55
  %61 = fmul double %cross.2.0.i, %.1427.i
  %.78.i58.i = fsub double %.78.i44.i, %61
  store double %.78.i58.i, ptr %60, align 8, !noalias !58
  %62 = getelementptr i8, ptr %58, i64 64
  %.77.i64.i = load double, ptr %62, align 8, !noalias !61
  %.78.i65.i = fadd double %.1812.i, %.77.i64.i
  store double %.78.i65.i, ptr %62, align 8, !noalias !61
  %63 = getelementptr i8, ptr %58, i64 72
  %.77.i71.i = load double, ptr %63, align 8, !noalias !64
  %.78.i72.i = fadd double %61, %.77.i71.i
  store double %.78.i72.i, ptr %63, align 8, !noalias !64
  %64 = getelementptr i8, ptr %58, i64 32
  %.77.i78.i = load double, ptr %64, align 8, !noalias !67
  %65 = fmul double %"$phi196.0.3.0.i", %.164.sink.i.i
  %.78.i79.i = fsub double %.77.i78.i, %65
  store double %.78.i79.i, ptr %64, align 8, !noalias !67
  %.2122.i = fmul double %"$phi232.0.3.0.i", %.164.sink.i.i
  %66 = fmul double %.456.i, %.1427.i
  %.2123.i = fsub double %.2122.i, %66
  %67 = getelementptr i8, ptr %58, i64 56
  %.77.i85.i = load double, ptr %67, align 8, !noalias !70
  %.78.i86.i = fsub double %.77.i85.i, %.2123.i
  store double %.78.i86.i, ptr %67, align 8, !noalias !70
  br i1 %57, label %B16.i8.i, label %B106.i2.i

B16.i8.i:                                         ; preds = %B1108.endif.endif.endif.e...endif.i
  %.22.i9.i = tail call double @llvm.fabs.f64(double %pull.2.0.i)
  %.25.i10.i = fadd double %arg.rig.28, %.852.i
  %.30.i11.i = fcmp ogt double %.22.i9.i, %.25.i10.i
  %.33.i12.i = tail call double @llvm.copysign.f64(double 1.000000e+00, double %pull.2.0.i)
  %"$phi104.0.2.0.i13.i" = select i1 %.30.i11.i, double %.33.i12.i, double 0.000000e+00
  br label %B380.endif.endif.endif.en...endif.endif.endif.endif

B106.i2.i:                                        ; preds = %B1108.endif.endif.endif.e...endif.i
  %.52.i3.i = fmul double %pull.2.0.i, %state.2.0.i
  %.57.i4.i = fsub double %.852.i, %arg.rig.28
  %.62.i5.i = fcmp olt double %.52.i3.i, %.57.i4.i
  %"$phi136.0.2.0.i6.i" = select i1 %.62.i5.i, double 0.000000e+00, double %state.2.0.i
  br label %B380.endif.endif.endif.en...endif.endif.endif.endif

B380.endif.endif.endif.en...endif.endif.endif.endif: ; preds = %B106.i2.i, %B16.i8.i
  %storemerge.i7.i = phi double [ %"$phi136.0.2.0.i6.i", %B106.i2.i ], [ %"$phi104.0.2.0.i13.i", %B16.i8.i ]
  %68 = icmp eq i8 %arg.settle, 0
  %.2197.i = fcmp une double %storemerge.i7.i, %state.2.0.i
  %sunkaddr400 = mul i64 %.1537, 8
  %sunkaddr401 = getelementptr i8, ptr %arg.work.1.4, i64 %sunkaddr400
  %sunkaddr402 = getelementptr i8, ptr %sunkaddr401, i64 8
  %.2231.i = load double, ptr %sunkaddr402, align 8, !noalias !37
  %.2239.i = tail call double @llvm.fabs.f64(double %.2231.i)
  %.12.i.i = fcmp ogt double %.2258.i, %.2239.i
  %69 = select i1 %.2197.i, i1 %.12.i.i, i1 false
  %storemerge.i = select i1 %69, double %.2258.i, double %.2239.i
  %.544.i = add nuw nsw i64 %.1537, 2
  %.699.i164 = fadd double %near.2.sroa.8.02049, %tb.4.0.i
  %70 = getelementptr double, ptr %arg.x.4, i64 %.544.i
  %.730.i165 = load double, ptr %70, align 8, !noalias !73
  %71 = getelementptr double, ptr %12, i64 %.150520282042
  %.827.i166 = load double, ptr %71, align 8, !noalias !73
  %.833.i167 = fsub double %.730.i165, %.827.i166
  %.835.i168 = fmul double %arg.rig.5.1, %.833.i167
  %.851.i169 = fmul double %.699.i164, %.257.i
  %.852.i170 = fadd double %constant.2.0.i, %.851.i169
  %bristle.2.0.i174 = select i1 %or.cond.i156, double 0.000000e+00, double %arg.rig.5.1
  %pull.2.0.i175 = select i1 %or.cond.i156, double 0.000000e+00, double %.835.i168
  %72 = getelementptr double, ptr %13, i64 %.150520282042
  %.944.i176 = load double, ptr %72, align 8, !noalias !73
  br i1 %68, label %B468.i188, label %B398.i177

B398.i177:                                        ; preds = %B380.endif.endif.endif.en...endif.endif.endif.endif
  %.17.i.i178 = fcmp oeq double %.944.i176, 0.000000e+00
  br i1 %.17.i.i178, label %B16.i.i275, label %B106.i.i179

B16.i.i275:                                       ; preds = %B398.i177
  %.22.i.i276 = tail call double @llvm.fabs.f64(double %pull.2.0.i175)
  %.25.i.i277 = fadd double %arg.rig.28, %.852.i170
  %.30.i.i278 = fcmp ogt double %.22.i.i276, %.25.i.i277
  %.33.i.i279 = tail call double @llvm.copysign.f64(double 1.000000e+00, double %pull.2.0.i175)
  %"$phi104.0.2.0.i.i280" = select i1 %.30.i.i278, double %.33.i.i279, double 0.000000e+00
  br label %B398.endif.i184

B106.i.i179:                                      ; preds = %B398.i177
  %.52.i.i180 = fmul double %.944.i176, %pull.2.0.i175
  %.57.i.i181 = fsub double %.852.i170, %arg.rig.28
  %.62.i.i182 = fcmp olt double %.52.i.i180, %.57.i.i181
  %"$phi136.0.2.0.i.i183" = select i1 %.62.i.i182, double 0.000000e+00, double %.944.i176
  br label %B398.endif.i184

B468.i188:                                        ; preds = %B398.endif.i184, %B380.endif.endif.endif.en...endif.endif.endif.endif
  %state.2.0.i189 = phi double [ %storemerge.i.i185, %B398.endif.i184 ], [ %.944.i176, %B380.endif.endif.endif.en...endif.endif.endif.endif ]
  %73 = getelementptr double, ptr %14, i64 %.150520282042
  store double %.852.i170, ptr %73, align 8, !noalias !73
  %.68.i.i190 = fcmp oeq double %state.2.0.i189, 0.000000e+00
  br i1 %.68.i.i190, label %B468.endif.endif.endif.i200, label %B54.i.i191

B54.i.i191:                                       ; preds = %B468.i188
  %.126.i.i192 = fmul double %.852.i170, %state.2.0.i189
  %.130.i.i193 = fmul double %.257.i, %state.2.0.i189
  %.133.i.i194 = fmul double %.699.i164, %state.2.0.i189
  %.138.i.i195 = fmul double %.133.i.i194, 5.000000e-01
  %.141.i.i196 = fmul double %arg.rig.14, %.138.i.i195
  %.162.i.i197 = fmul double %.257.i, %.257.i
  %.163.i.i198 = fsub double 1.000000e+00, %.162.i.i197
  %.164.i.i199 = fmul double %.163.i.i198, %.141.i.i196
  br label %B468.endif.endif.endif.i200

B398.endif.i184:                                  ; preds = %B106.i.i179, %B16.i.i275
  %storemerge.i.i185 = phi double [ %"$phi136.0.2.0.i.i183", %B106.i.i179 ], [ %"$phi104.0.2.0.i.i280", %B16.i.i275 ]
  %sunkaddr403 = mul i64 %.150520282042, 8
  %sunkaddr404 = getelementptr inbounds i8, ptr %13, i64 %sunkaddr403
  store double %storemerge.i.i185, ptr %sunkaddr404, align 8, !noalias !73
  br label %B468.i188

B468.endif.endif.endif.i200:                      ; preds = %B54.i.i191, %B468.i188
  %.126.sink.i.i201 = phi double [ %.126.i.i192, %B54.i.i191 ], [ %pull.2.0.i175, %B468.i188 ]
  %.sink.i.i202 = phi double [ 0.000000e+00, %B54.i.i191 ], [ %bristle.2.0.i174, %B468.i188 ]
  %.130.sink.i.i203 = phi double [ %.130.i.i193, %B54.i.i191 ], [ 0.000000e+00, %B468.i188 ]
  %.164.sink.i.i204 = phi double [ %.164.i.i199, %B54.i.i191 ], [ 0.000000e+00, %B468.i188 ]
  %74 = icmp eq i64 %.150520282042, 0
  %.1254.i205 = fsub double %near.2.sroa.8.02049, %tb.4.0.i
  %.1257.i206 = fsub double %.1254.i205, %.126.sink.i.i201
  %sunkaddr405 = mul i64 %.1537, 8
  %sunkaddr406 = getelementptr i8, ptr %arg.x.4, i64 %sunkaddr405
  %sunkaddr407 = getelementptr i8, ptr %sunkaddr406, i64 16
  %.1290.i208 = load double, ptr %sunkaddr407, align 8, !noalias !73
  %sunkaddr408 = mul i64 %.1537, 8
  %sunkaddr409 = getelementptr i8, ptr %arg.work.8.4, i64 %sunkaddr408
  %sunkaddr410 = getelementptr i8, ptr %sunkaddr409, i64 16
  %.1330.i209 = load double, ptr %sunkaddr410, align 8, !noalias !73
  %.1334.i210 = fsub double %.1290.i208, %.1330.i209
  %.1335.i211 = fmul double %drag.2.0.i, %.1334.i210
  %.1336.i212 = fsub double %.1257.i206, %.1335.i211
  %sunkaddr411 = mul i64 %.1537, 8
  %sunkaddr412 = getelementptr i8, ptr %arg.work.1.4, i64 %sunkaddr411
  %sunkaddr413 = getelementptr i8, ptr %sunkaddr412, i64 16
  store double %.1336.i212, ptr %sunkaddr413, align 8, !noalias !73
  %.1424.i213 = fsub double 1.000000e+00, %.130.sink.i.i203
  %.1427.i214 = fadd double %.130.sink.i.i203, 1.000000e+00
  br i1 %74, label %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i216, label %B744.endif.endif.endif.endif.i264

B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i216: ; preds = %B468.endif.endif.endif.i200
  %.pre.i217 = fmul double %near.2.sroa.24.02047, %.1424.i213
  %.pre91.i218 = fmul double %near.2.sroa.32.02046, %.1424.i213
  %.pre282 = mul i64 %.544.i, %arg.work.0.5.1
  br label %B1108.endif.endif.endif.e...endif.i219

B744.endif.endif.endif.endif.i264:                ; preds = %B468.endif.endif.endif.i200
  %.1492.i265 = fmul double %near.2.sroa.48.02044, %.1424.i213
  %.72.i.i266 = mul i64 %.544.i, %arg.work.0.5.1
  %75 = getelementptr double, ptr %arg.work.0.4, i64 %.72.i.i266
  %76 = getelementptr i8, ptr %75, i64 24
  %.77.i.i267 = load double, ptr %76, align 8, !noalias !76
  %.78.i.i268 = fadd double %.1492.i265, %.77.i.i267
  store double %.78.i.i268, ptr %76, align 8, !noalias !76
  %.1561.i269 = fmul double %near.2.sroa.24.02047, %.1424.i213
  %77 = getelementptr i8, ptr %75, i64 16
  %.77.i22.i270 = load double, ptr %77, align 8, !noalias !79
  %.78.i23.i271 = fadd double %.1561.i269, %.77.i22.i270
  store double %.78.i23.i271, ptr %77, align 8, !noalias !79
  %.1598.i272 = fmul double %near.2.sroa.32.02046, %.1424.i213
  %78 = getelementptr i8, ptr %75, i64 8
  %.77.i29.i273 = load double, ptr %78, align 8, !noalias !82
  %.78.i30.i274 = fadd double %.1598.i272, %.77.i29.i273
  store double %.78.i30.i274, ptr %78, align 8, !noalias !82
  br label %B1108.endif.endif.endif.e...endif.i219

B1108.endif.endif.endif.e...endif.i219:           ; preds = %B744.endif.endif.endif.endif.i264, %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i216
  %.72.i35.i222.pre-phi = phi i64 [ %.72.i.i266, %B744.endif.endif.endif.endif.i264 ], [ %.pre282, %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i216 ]
  %.pre-phi92.i220 = phi double [ %.1598.i272, %B744.endif.endif.endif.endif.i264 ], [ %.pre91.i218, %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i216 ]
  %.pre-phi.i221 = phi double [ %.1561.i269, %B744.endif.endif.endif.endif.i264 ], [ %.pre.i217, %B468.endif.endif.endif.B1108.endif.endif.endif.e...endif_crit_edge.i216 ]
  %79 = fcmp oeq double %state.2.0.i189, 0.000000e+00
  %80 = getelementptr double, ptr %arg.work.0.4, i64 %.72.i35.i222.pre-phi
  %81 = getelementptr i8, ptr %80, i64 40
  %.77.i36.i223 = load double, ptr %81, align 8, !noalias !85
  %.78.i37.i224 = fsub double %.77.i36.i223, %.pre-phi.i221
  %82 = getelementptr i8, ptr %80, i64 32
  %.77.i43.i225 = load double, ptr %82, align 8, !noalias !88
  %.78.i44.i226 = fsub double %.77.i43.i225, %.pre-phi92.i220
  %.1812.i228 = fmul double %own_b.3.0.i, %.1427.i214
  %.1815.i229 = fadd double %.sink.i.i202, %.1812.i228
  %.1818.i230 = fadd double %drag.2.0.i, %.1815.i229
  %.1819.i231 = fadd double %.1772.i227, %.1818.i230
  %.78.i51.i232 = fsub double %.78.i37.i224, %.1819.i231
  store double %.78.i51.i232, ptr %81, align 8, !noalias !91
  %83 = fmul double %cross.2.0.i, %.1427.i214
  %.78.i58.i233 = fsub double %.78.i44.i226, %83
  store double %.78.i58.i233, ptr %82, align 8, !noalias !94
  %84 = getelementptr i8, ptr %80, i64 64
  %.77.i64.i234 = load double, ptr %84, align 8, !noalias !97
  %.78.i65.i235 = fadd double %.1812.i228, %.77.i64.i234
  store double %.78.i65.i235, ptr %84, align 8, !noalias !97
  %85 = getelementptr i8, ptr %80, i64 56
  %.77.i71.i236 = load double, ptr %85, align 8, !noalias !100
  %.78.i72.i237 = fadd double %83, %.77.i71.i236
  store double %.78.i72.i237, ptr %85, align 8, !noalias !100
  %86 = getelementptr i8, ptr %80, i64 24
  %.77.i78.i238 = load double, ptr %86, align 8, !noalias !103
  %87 = fmul double %"$phi196.0.3.0.i", %.164.sink.i.i204
  %.78.i79.i239 = fsub double %.77.i78.i238, %87
  store double %.78.i79.i239, ptr %86, align 8, !noalias !103
  %.2122.i241 = fmul double %"$phi232.0.3.0.i", %.164.sink.i.i204
  %88 = fmul double %.470.i, %.1427.i214
  %.2123.i242 = fsub double %.2122.i241, %88
  %89 = getelementptr i8, ptr %80, i64 48
  %.77.i85.i243 = load double, ptr %89, align 8, !noalias !106
  %.78.i86.i244 = fsub double %.77.i85.i243, %.2123.i242
  store double %.78.i86.i244, ptr %89, align 8, !noalias !106
  br i1 %79, label %B16.i8.i258, label %B106.i2.i245

B16.i8.i258:                                      ; preds = %B1108.endif.endif.endif.e...endif.i219
  %.22.i9.i259 = tail call double @llvm.fabs.f64(double %pull.2.0.i175)
  %.25.i10.i260 = fadd double %arg.rig.28, %.852.i170
  %.30.i11.i261 = fcmp ogt double %.22.i9.i259, %.25.i10.i260
  %.33.i12.i262 = tail call double @llvm.copysign.f64(double 1.000000e+00, double %pull.2.0.i175)
  %"$phi104.0.2.0.i13.i263" = select i1 %.30.i11.i261, double %.33.i12.i262, double 0.000000e+00
  br label %B380.endif.endif.endif.en...endif.1.endif

B106.i2.i245:                                     ; preds = %B1108.endif.endif.endif.e...endif.i219
  %.52.i3.i246 = fmul double %pull.2.0.i175, %state.2.0.i189
  %.57.i4.i247 = fsub double %.852.i170, %arg.rig.28
  %.62.i5.i248 = fcmp olt double %.52.i3.i246, %.57.i4.i247
  %"$phi136.0.2.0.i6.i249" = select i1 %.62.i5.i248, double 0.000000e+00, double %state.2.0.i189
  br label %B380.endif.endif.endif.en...endif.1.endif

B380.endif.endif.endif.en...endif.1.endif:        ; preds = %B16.i8.i258, %B106.i2.i245
  %storemerge.i7.i250 = phi double [ %"$phi136.0.2.0.i6.i249", %B106.i2.i245 ], [ %"$phi104.0.2.0.i13.i263", %B16.i8.i258 ]
  %.2197.i251 = fcmp une double %storemerge.i7.i250, %state.2.0.i189
  %sunkaddr414 = mul i64 %.1537, 8
  %sunkaddr415 = getelementptr i8, ptr %arg.work.1.4, i64 %sunkaddr414
  %sunkaddr416 = getelementptr i8, ptr %sunkaddr415, i64 16
  %.2231.i253 = load double, ptr %sunkaddr416, align 8, !noalias !73
  %.2239.i254 = tail call double @llvm.fabs.f64(double %.2231.i253)
  %.12.i.i256 = fcmp ogt double %.2258.i, %.2239.i254
  %90 = select i1 %.2197.i251, i1 %.12.i.i256, i1 false
  %storemerge.i257 = select i1 %90, double %.2258.i, double %.2239.i254
  %.16.i = fcmp ogt double %storemerge.i, %.13.i
  %.17.i = select i1 %.16.i, double %storemerge.i, double %.13.i
  %.18.i = fcmp ogt double %storemerge.i257, %.17.i
  %.19.i = select i1 %.18.i, double %storemerge.i257, double %.17.i
  %exitcond.not = icmp eq i64 %.1512, %arg.memory.0.5.1
  br i1 %exitcond.not, label %B1614, label %B380.endif

B1674.endif:                                      ; preds = %B1674
  tail call void @NRT_decref(ptr %arg.work.0.0)
  tail call void @NRT_decref(ptr %arg.work.1.0)
  tail call void @NRT_decref(ptr %arg.work.2.0)
  tail call void @NRT_decref(ptr %arg.work.3.0)
  tail call void @NRT_decref(ptr %arg.work.4.0)
  tail call void @NRT_decref(ptr %arg.work.5.0)
  tail call void @NRT_decref(ptr %arg.work.6.0)
  tail call void @NRT_decref(ptr %arg.work.7.0)
  tail call void @NRT_decref(ptr %arg.work.8.0)
  tail call void @NRT_decref(ptr %arg.work.9.0)
  br label %B1704

B1674.if.if:                                      ; preds = %B1674
  store ptr null, ptr %excinfo, align 8
  br label %common.ret
}